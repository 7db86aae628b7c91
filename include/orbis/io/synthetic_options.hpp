// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Options of a synthetic recording: the room, the camera's motion, and the errors of the sensor.
#pragma once

#include <cstdint>

#include <orbis/camera/shutter.hpp>

namespace orbis::io {

/// The recorded room.
struct synthetic_scene_options {
  double length = 6.0;           ///< along x, metres
  double width = 5.0;            ///< along y, metres
  double height = 3.0;           ///< metres
  double size_jitter = 0.05;     ///< relative variation of length and width with the seed
  bool furniture = true;         ///< false: bare walls
  int poor_walls = 1;            ///< number of walls (0..4) that have almost no texture
  double texture_density = 1.0;  ///< scales the number of patches painted on every surface; 0: none
  bool person = false;           ///< adds a person who walks around the room, opposite to the camera, at 1 m/s
  double wall_period = 0.0;      ///< if above 0, all walls show the same picture, repeated with this period, metres
  double light = 1.0;            ///< relative illumination; exposure time: `exposure` / `light`, at most `max_exposure`
};

/// The gait of a legged robot with the camera on its body: its motion is added to the path, in proportion to the speed
/// along the path. Every step lifts and pitches the body, left and right steps roll it in opposite directions, and each
/// foot impact makes it vibrate. The strength of the impacts varies between 0.5 and 1.5 times the amplitudes.
struct synthetic_gait_options {
  double step_rate = 0.0;          ///< steps per second; 0: no gait
  double bounce = 0.008;           ///< amplitude of the vertical motion, one oscillation per step, metres
  double pitch = 0.012;            ///< amplitude of the pitch, one oscillation per step, radians
  double roll = 0.020;             ///< amplitude of the roll, one oscillation per two steps, radians
  double impact = 0.0015;          ///< amplitude of the vertical vibration after an impact, metres
  double impact_angle = 0.006;     ///< amplitude of the pitch and roll vibration after an impact, radians
  double impact_frequency = 17.0;  ///< frequency of the vibration after an impact, Hz
  double impact_duration = 0.2;    ///< time until the vibration has decayed to 0, seconds
};

/// The motion of the camera. The camera starts at rest, makes one round (360 degrees of yaw) on an ellipse about the
/// room's centre while looking outward, and rests at its initial pose for the last fraction `overlap` of the time, so
/// that a loop can be closed. With `sees_floor`, it makes a second round on a larger ellipse, looking inward and down.
struct synthetic_path_options {
  double semi_axis_x = 0.80;  ///< semi-axis of the ellipse along x, metres
  double semi_axis_y = 0.60;  ///< semi-axis of the ellipse along y, metres
  double height = 1.35;       ///< height of the camera above the floor, metres
  double pitch = -0.20;       ///< mean pitch, radians; negative looks down
  double overlap = 0.05;      ///< fraction of the time spent at the initial pose after the rounds
  bool sees_floor = false;    ///< adds a round with the camera pointing inward and down at the floor
  double wobble = 1.0;        ///< scales the slow sway in height, distance, yaw, pitch and roll
  double jitter = 1.0;        ///< scales the hand tremor (millimetres, tenths of degrees)
  synthetic_gait_options gait{};

  /// Number of rounds of the path.
  [[nodiscard]] int rounds() const noexcept { return sees_floor ? 2 : 1; }
};

/// Errors of a Kinect- or Astra-like camera; 0 (or false) disables an error.
///
/// Depth: axial noise with a standard deviation of 0.0012 + 0.0019 (z - 0.4)^2 metres and lateral noise, both from
/// C. V. Nguyen, S. Izadi, D. Lovell, "Modeling Kinect sensor noise for improved 3D reconstruction and tracking",
/// 3DIMPVT 2012; disparity in steps of 1/8 pixel (K. Khoshelham, S. O. Elberink, "Accuracy and resolution of Kinect
/// depth data", Sensors 2012).
struct synthetic_sensor_options {
  double min_depth = 0.4;  ///< minimum depth, metres; smaller depths are not measured
  double max_depth = 4.5;  ///< maximum depth, metres; larger depths are not measured; 0: no limit

  double axial_noise = 1.0;       ///< factor applied to the published standard deviation
  double lateral_noise = 0.5;     ///< standard deviation in pixels of the position of a ray near a depth edge
  double flying_pixels = 0.15;    ///< fraction of pixels on a depth edge with a depth between those of its sides
  double disparity_step = 0.125;  ///< resolution of the disparity, pixels of the infrared camera
  double infrared_focal = 580.0;  ///< focal length of the infrared camera, pixels: disparity = focal * baseline / depth
  double baseline = 0.075;        ///< distance from projector to camera, metres
  double grazing_angle = 1.45;    ///< maximum angle of incidence, radians; pixels start to drop out
                                  ///< 0.15 radians below it
  bool shadow = true;             ///< no depth on surfaces that the projector (on the right) does not illuminate
  double dropouts = 0.002;        ///< fraction of pixels without depth at random positions
  double stray_depths = 0.0;      ///< fraction of pixels with a random depth in front of the surface: dust, rain, spray

  double stereo_baseline = 0.12;  ///< distance between the cameras of a stereo pair, metres

  double colour_noise = 2.0;  ///< standard deviation of the colour noise, grey values
  int motion_blur = 1;        ///< number of images averaged over the exposure time; 1: no blur
  double exposure = 0.015;    ///< exposure time at a `light` of 1, for motion blur, seconds
  /// Maximum exposure time in a darker room, seconds. If the required time is f times longer, the colour noise is
  /// increased by sqrt(f) instead.
  double max_exposure = 0.033;
  /// Number of depth images whose disparities are averaged over `depth_exposure`; 1: no averaging. Planes remain
  /// planar, and edges are blurred along the motion.
  int depth_blur = 1;
  double depth_exposure = 0.015;  ///< integration time of the depth image, independent of the light, seconds

  /// Readout times; the pose and time of a frame are those of the middle row of its colour image.
  camera::shutter shutter{};

  /// An ideal sensor: only the rounding to whole depth units remains.
  [[nodiscard]] static synthetic_sensor_options ideal() noexcept {
    return {.min_depth = 0.0,
            .max_depth = 0.0,
            .axial_noise = 0.0,
            .lateral_noise = 0.0,
            .flying_pixels = 0.0,
            .disparity_step = 0.0,
            .grazing_angle = 0.0,
            .shadow = false,
            .dropouts = 0.0,
            .colour_noise = 0.0};
  }
};

/// Options of `synthetic_recording`.
struct synthetic_options {
  int frames = 400;           ///< number of frames
  double fps = 30.0;          ///< frames per second
  std::uint64_t seed = 1;     ///< seed of the room, its textures, the path and the noise
  int width = 640;            ///< pixels
  int height = 480;           ///< pixels
  double depth_scale = 5000;  ///< stored depth / depth_scale = metres; the maximum depth with 5000 is 13 m
  int frames_around = 0;      ///< number of frames per round of the path; 0: the path takes all frames
  synthetic_scene_options scene{};
  synthetic_path_options path{};
  synthetic_sensor_options sensor{};
};

}  // namespace orbis::io

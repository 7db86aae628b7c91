// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Options of a synthetic recording: the room, the camera's motion, and the errors of the sensor.
#pragma once

#include <cstdint>

#include <orbis/camera/shutter.hpp>

namespace orbis::io {

/// The room that is recorded.
struct synthetic_scene_options {
  double length = 6.0;           ///< along x, metres
  double width = 5.0;            ///< along y, metres
  double height = 3.0;           ///< metres
  double size_jitter = 0.05;     ///< relative variation of length and width with the seed
  bool furniture = true;         ///< false: bare walls
  int poor_walls = 1;            ///< number of the four walls that have almost no texture, 0..4
  double texture_density = 1.0;  ///< scales the number of patches painted on every surface; 0: none
  bool person = false;           ///< adds a person who walks around the room, against the camera's direction, at 1 m/s
  double wall_period = 0.0;      ///< metres; if above 0 all walls show one picture that repeats at this distance
  double light = 1.0;  ///< illumination; at 1 the sensor's `exposure` suits it, at 0.5 it takes twice that time
};

/// The gait of a legged robot with the camera on its body: motion in addition to the path, in proportion to the speed
/// along it. Every step lifts and pitches the body, left and right steps roll it in turn, and each impact of a foot
/// makes it vibrate. The strength of the impacts varies from half to one and a half times the amplitudes.
struct synthetic_gait_options {
  double step_rate = 0.0;          ///< steps per second; 0: no gait
  double bounce = 0.008;           ///< amplitude of the height, one oscillation per step, metres
  double pitch = 0.012;            ///< amplitude of the pitch, one oscillation per step, radians
  double roll = 0.020;             ///< amplitude of the roll, one oscillation per two steps, radians
  double impact = 0.0015;          ///< amplitude of the height after an impact, metres
  double impact_angle = 0.006;     ///< amplitude of pitch and roll after an impact, radians
  double impact_frequency = 17.0;  ///< of the vibration after an impact, Hz
  double impact_duration = 0.2;    ///< seconds until the vibration has decayed to 0
};

/// The motion of the camera. The path starts at rest, makes one round (360 degrees of yaw) on an ellipse about the
/// room's centre while looking outward, and rests at its first view again for the last fraction `overlap` of the time,
/// so that a loop can close. With `sees_floor` it makes a second round on a larger ellipse, looking inward and down.
struct synthetic_path_options {
  double semi_axis_x = 0.80;  ///< of the ellipse, metres
  double semi_axis_y = 0.60;  ///< metres
  double height = 1.35;       ///< of the camera above the floor, metres
  double pitch = -0.20;       ///< mean pitch, radians; negative looks down
  double overlap = 0.05;      ///< fraction of the time spent at the first view again
  bool sees_floor = false;    ///< adds a round that looks inward and down at the floor
  double wobble = 1.0;        ///< scales the slow sway in height, distance, yaw, pitch and roll
  double jitter = 1.0;        ///< scales the tremor of the hand (millimetres, tenths of degrees)
  synthetic_gait_options gait{};

  /// Number of rounds of the path.
  [[nodiscard]] int rounds() const noexcept { return sees_floor ? 2 : 1; }
};

/// Errors of a Kinect- or Astra-like camera; 0 (or false) disables one.
///
/// Depth: axial noise of deviation 0.0012 + 0.0019 (z - 0.4)^2 metres and lateral noise, both from
/// C. V. Nguyen, S. Izadi, D. Lovell, "Modeling Kinect sensor noise for improved 3D reconstruction and
/// tracking", 3DIMPVT 2012; disparity in steps of 1/8 pixel (K. Khoshelham, S. O. Elberink, "Accuracy
/// and resolution of Kinect depth data", Sensors 2012).
struct synthetic_sensor_options {
  double min_depth = 0.4;  ///< metres; smaller depths are not measured
  double max_depth = 4.5;  ///< metres; larger depths are not measured; 0: no limit

  double axial_noise = 1.0;       ///< factor on the published standard deviation
  double lateral_noise = 0.5;     ///< standard deviation in pixels of the position of a ray near a depth edge
  double flying_pixels = 0.15;    ///< fraction of the pixels on a depth edge with a depth between its two sides
  double disparity_step = 0.125;  ///< resolution of the disparity, pixels of the infrared camera
  double infrared_focal = 580.0;  ///< of the infrared camera, pixels: disparity = focal * baseline / depth
  double baseline = 0.075;        ///< from projector to camera, metres
  double grazing_angle = 1.45;    ///< maximum angle of incidence, radians; pixels begin to drop out
                                  ///< 0.15 radians below it
  bool shadow = true;             ///< no depth where the projector (on the right) does not reach
  double dropouts = 0.002;        ///< fraction of pixels lost anywhere
  double stray_depths = 0.0;      ///< fraction of pixels with a random depth in front of the surface: dust, rain, spray

  double stereo_baseline = 0.12;  ///< from the camera to the second one of a stereo pair, metres

  double colour_noise = 2.0;  ///< standard deviation in grey values
  int motion_blur = 1;        ///< images averaged over the exposure time; 1: none
  double exposure = 0.015;    ///< seconds, at a `light` of 1; for motion blur
  /// Maximum exposure time in a darker room, seconds. Beyond that, a lack of light increases the colour noise instead,
  /// by the square root of the missing factor.
  double max_exposure = 0.033;
  /// Number of depth images whose disparities are averaged over `depth_exposure`; 1: none. Planes stay planes, and
  /// edges are smeared along the motion.
  int depth_blur = 1;
  double depth_exposure = 0.015;  ///< integration time of the depth image, independent of the light, seconds

  /// Times of the rows of an image; a frame has the pose and the time of its colour image's middle.
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
  std::uint64_t seed = 1;     ///< of the room, its textures, the path and the noise
  int width = 640;            ///< pixels
  int height = 480;           ///< pixels
  double depth_scale = 5000;  ///< stored depth / depth_scale = metres; 5000 reaches 13 m
  int frames_around = 0;      ///< number of frames per round of the path; 0: all frames make up the path
  synthetic_scene_options scene{};
  synthetic_path_options path{};
  synthetic_sensor_options sensor{};
};

}  // namespace orbis::io

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Cameras of common public recordings, identified by name.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include <orbis/camera/any.hpp>
#include <orbis/camera/settings.hpp>
#include <orbis/camera/shutter.hpp>
#include <orbis/core/quote.hpp>
#include <orbis/core/result.hpp>

namespace orbis::camera {

/// The names that `preset` accepts.
inline constexpr std::array<std::string_view, 5> preset_names{"tum_fr1", "tum_fr2", "tum_fr3", "icl", "kinect"};

/// Returns the camera of the TUM RGB-D benchmark's freiburg1, 2 and 3 sequences (the published calibration of the
/// colour camera; freiburg3 is already undistorted), of ICL-NUIM, or of a Kinect with nominal values. All are 640x480
/// at 30 frames per second.
///
/// Sources: J. Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012, and its web page on
/// file formats; A. Handa et al., "A benchmark for RGB-D visual odometry, 3D reconstruction and SLAM", ICRA 2014 (its y
/// axis points up, hence its negative fy; here y points down). Errors: invalid_argument for an unknown name, with the
/// list of valid names.
[[nodiscard]] inline result<camera_settings> preset(std::string_view name) {
  if (name == "tum_fr1")
    return camera_settings{
        .model = radial_tangential{{640, 480, 517.3, 516.5, 318.6, 255.3}, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}},
        .depth_scale = 5000.0};
  if (name == "tum_fr2")
    return camera_settings{
        .model = radial_tangential{{640, 480, 520.9, 521.0, 325.1, 249.7}, {0.2312, -0.7849, -0.0033, -0.0001, 0.9172}},
        .depth_scale = 5000.0};
  if (name == "tum_fr3")
    return camera_settings{.model = pinhole{640, 480, 535.4, 539.2, 320.1, 247.6}, .depth_scale = 5000.0};
  if (name == "icl")
    return camera_settings{.model = pinhole{640, 480, 481.2, 480.0, 319.5, 239.5}, .depth_scale = 5000.0};
  if (name == "kinect") return camera_settings{.model = pinhole{640, 480, 525.0, 525.0, 319.5, 239.5}};

  std::string known;
  for (const std::string_view n : preset_names) known += (known.empty() ? "" : ", ") + std::string{n};
  return fail(errc::invalid_argument, "camera preset", in_quotes(name) + " is not one of " + known);
}

/// Returns the typical shutter of the Kinect that recorded TUM's freiburg1 sequences if `camera` equals that of the
/// preset `tum_fr1`, and nothing for other cameras. Its standard deviations are about 2 ms (read-out) and 3 ms (delay).
/// It requires separate time stamps of colour and depth images, because their difference varies.
///
/// Source: estimates of `slam::options::estimates_shutter` for 220 frames of freiburg1_xyz, 20 to 23 ms and -10 to
/// -16 ms. The errors of nine frames of freiburg1_desk are least for 15 to 25 ms and -13 to -22 ms.
[[nodiscard]] inline std::optional<shutter> typical_shutter(const any_camera& camera) {
  if (camera != preset("tum_fr1").value().model) return std::nullopt;
  return shutter{.color_read_out = 0.020, .depth_read_out = 0.020, .depth_delay = -0.013};
}

}  // namespace orbis::camera

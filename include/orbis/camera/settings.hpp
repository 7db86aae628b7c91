// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The settings of an RGB-D camera that are needed to use its recordings.
#pragma once

#include <optional>

#include <orbis/camera/any.hpp>
#include <orbis/camera/shutter.hpp>

namespace orbis::camera {

/// The settings of an RGB-D camera, from `camera.toml` or `preset`.
struct camera_settings {
  any_camera model;
  double depth_scale = 1000.0;               ///< stored depth / depth_scale = metres
  double fps = 30.0;                         ///< frames per second
  std::optional<double> baseline{};          ///< distance between infrared projector and camera, metres, if known
  std::optional<camera::shutter> shutter{};  ///< timing of the image rows, if known
};

}  // namespace orbis::camera

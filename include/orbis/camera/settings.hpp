// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What has to be known about an RGB-D camera to use its recordings.
#pragma once

#include <optional>

#include <orbis/camera/any.hpp>
#include <orbis/camera/shutter.hpp>

namespace orbis::camera {

/// The settings of an RGB-D camera: what `camera.toml` and `preset` give.
struct camera_settings {
  any_camera model;
  double depth_scale = 1000.0;               ///< stored depth / depth_scale = metres
  double fps = 30.0;                         ///< frames per second
  std::optional<double> baseline{};          ///< between infrared projector and camera, metres, where known
  std::optional<camera::shutter> shutter{};  ///< when the rows of the images are taken, where known
};

}  // namespace orbis::camera

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The SLAM options that depend on the camera.
#pragma once

#include <optional>

#include <orbis/camera/any.hpp>
#include <orbis/slam/options.hpp>

namespace app {

/// Options for a depth camera; a known `baseline` (metres) determines the accuracy of its depth.
[[nodiscard]] inline orbis::slam::options slam_options(const orbis::camera::any_camera& camera,
                                                       const std::optional<double>& baseline) {
  orbis::slam::options options;
  if (baseline) options.bf = orbis::slam::depth_camera_bf(camera.k().fx, *baseline);
  return options;
}

}  // namespace app

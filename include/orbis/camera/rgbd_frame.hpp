// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A frame of an RGB-D camera.
#pragma once

#include <cstdint>
#include <optional>

#include <orbis/camera/depth.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>

namespace orbis::camera {

/// A colour image and a depth image registered to it (same size, same camera).
struct rgbd_frame {
  double timestamp = 0.0;                   ///< time of the colour image, seconds
  std::optional<double> depth_timestamp{};  ///< time of the depth image, seconds; empty: unknown
  image<rgb8> color;
  image<std::uint16_t> depth;  ///< stored value / depth_scale = metres; 0 and 65535 invalid
  double depth_scale = 1000.0;
  std::optional<se3> T_world_camera;  ///< ground truth, if recorded

  [[nodiscard]] depth_view<std::uint16_t> depth_metres() const {
    return depth_view<std::uint16_t>(depth.view(), depth_scale);
  }
};

}  // namespace orbis::camera

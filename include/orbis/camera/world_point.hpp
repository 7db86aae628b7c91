// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Converts a pixel and its depth to a point in the world. Every component that converts depth images to points uses
/// this function, so that all of them get the same points, bit for bit.
#pragma once

#include <array>
#include <cstddef>

#include <orbis/core/rounded.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>

namespace orbis::camera {

/// `T_world_camera` in float: the rows of its rotation, and the camera's centre (metres).
struct float_pose {
  std::array<std::array<float, 3>, 3> rows{};
  std::array<float, 3> centre{};

  explicit float_pose(const se3& T_world_camera) {
    const mat3 r = T_world_camera.rotation_matrix();
    for (std::size_t i = 0; i != 3; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      centre[i] = static_cast<float>(T_world_camera.translation()[row]);
      for (std::size_t j = 0; j != 3; ++j) rows[i][j] = static_cast<float>(r(row, static_cast<Eigen::Index>(j)));
    }
  }
};

/// The world point (metres) at depth `z` (metres along the optical axis) on the ray through (x, y, 1) in the camera
/// frame. Evaluated in float in a fixed order, rounded after every operation, so that every compiler and every
/// instruction set gives the same bits. The error is less than 1 um for scenes the size of a room. O(1).
[[nodiscard]] inline std::array<float, 3> world_point(const float_pose& pose, float x, float y, float z) noexcept {
  const float cx = rounded_product(x, z), cy = rounded_product(y, z);
  std::array<float, 3> p;
  for (std::size_t i = 0; i != 3; ++i)
    p[i] = ((rounded_product(pose.rows[i][0], cx) + rounded_product(pose.rows[i][1], cy)) +
            rounded_product(pose.rows[i][2], z)) +
           pose.centre[i];
  return p;
}

}  // namespace orbis::camera

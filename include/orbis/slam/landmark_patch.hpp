// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The image patch of a landmark, used to measure its position in later images.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include <orbis/core/sim3.hpp>
#include <orbis/core/types.hpp>

namespace orbis::slam {

/// The pixels around a landmark in one image, which show the surface around the landmark. Pixel (u, v) shows the point
/// `position + (u - centre) * across + (v - centre) * down`.
struct landmark_patch {
  static constexpr int size = 24;  ///< pixels per side, most of which are a margin for motion blur
  static constexpr double centre = 0.5 * (size - 1);
  using pixel_array = std::array<std::uint8_t, std::size_t{size} * size>;

  std::shared_ptr<const pixel_array> pixels;  ///< row by row; null: the landmark has no patch
  vec3 across = zeros<vec3>();  ///< step from a pixel to the next one in its row, in the world frame, metres
  vec3 down = zeros<vec3>();    ///< step from a row to the next one, in the world frame, metres
  /// Standard deviation of a corner's position along the motion blur, in pixels of the level of the keypoint where the
  /// patch was taken.
  float corner_deviation = 1.0F;
  float coarseness = 1.0F;      ///< size of its pixels, in pixels of the level of the keypoint where it was taken
  bool is_flat = true;          ///< false if depth shows several surfaces in the patch
  vec2 motion = zeros<vec2>();  ///< velocity of the landmark in the image, patch pixels per second

  /// Moves the surface by a motion in the world frame.
  void move(const sim3& T_new_old) {
    across = T_new_old.scale() * (T_new_old.rotation() * across);
    down = T_new_old.scale() * (T_new_old.rotation() * down);
  }
};

}  // namespace orbis::slam

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Directions of the rays of a scan, as windows on the faces of a cube around the origin.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/core/jacobi.hpp>
#include <orbis/core/types.hpp>
#include <orbis/octree/detail/mark/rays/ray_traversal.hpp>

namespace orbis::octree::detail {

/// A window on one face of the cube |x|, |y|, |z| <= 1, divided into square cells. Face 2 i is on the positive side of
/// the cube's i-th axis, face 2 i + 1 on the negative one. The window's z axis points from the centre to the face.
struct direction_window {
  static constexpr std::int32_t padding = 16;  ///< minimum number of empty cells after each row

  std::array<float3, 3> axes{};  ///< x, y and z axes of the window, in the world frame
  float min_x = 0, min_y = 0;    ///< start of the first cell, at z = 1
  std::int32_t width = 0, height = 0;
  std::int32_t stride = 0;  ///< offset between rows
  std::uint32_t begin = 0;  ///< index of the first cell
};

/// Statistics of the rays to a sample of a scan's points.
struct sampled_rays {
  std::vector<vec3> directions;  ///< unit vectors
  double length = 0.0;           ///< mean length, metres
};

/// Windows that contain nearly all of a scan's rays. The cube is rotated so that the rays of a camera pass through the
/// middle of one face, with the image sides parallel to the sides of the face.
template <class = void>
struct basic_direction_windows {
  static constexpr std::size_t faces = 6;
  static constexpr std::uint32_t most_cells = 1U << 22U;

  std::array<direction_window, faces> window{};
  double spacing = 1;       ///< spacing of the rays at z = 1, assuming that they are spread evenly over the windows
  float cell = 1;           ///< edge of a cell, at z = 1
  std::uint32_t cells = 0;  ///< total number of cells of all windows

  /// Chooses windows for `count` rays, based on a sample. The cells have edge `wanted` (at z = 1), adjusted so that
  /// they contain between `fewest` and `most` rays on average. O(sample)
  void fit(const sampled_rays& sample, std::size_t count, double wanted, double fewest, double most) {
    const mat3 turned = cube_rotation(sample.directions);
    std::array<float3, 3> axes;  // axes of the cube, in the world frame
    for (int i = 0; i != 3; ++i)
      for (int k = 0; k != 3; ++k)
        axes[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)] = static_cast<float>(turned(i, k));
    struct box {
      float x0 = std::numeric_limits<float>::infinity(), x1 = -x0, y0 = x0, y1 = x1;
      std::size_t rays = 0;
    };
    std::array<box, faces> boxes;
    for (const vec3& direction : sample.directions) {
      const vec3 d = turned * direction;
      int axis = std::fabs(d[1]) > std::fabs(d[0]) ? 1 : 0;
      if (std::fabs(d[2]) > std::fabs(d[axis])) axis = 2;
      box& b = boxes[static_cast<std::size_t>(2 * axis + (d[axis] < 0.0 ? 1 : 0))];
      const auto x = static_cast<float>(d[axis_x(axis)] / std::fabs(d[axis]));
      const auto y = static_cast<float>(d[axis_y(axis)] / std::fabs(d[axis]));
      b = {std::min(b.x0, x), std::max(b.x1, x), std::min(b.y0, y), std::max(b.y1, y), b.rays + 1};
    }
    double area = 0.0;
    float longest = 0.0F;
    for (box& b : boxes) {
      if (b.rays == 0) continue;
      // The sample may miss the outermost rays.
      const float room = 1e-3F + 0.01F * std::max(b.x1 - b.x0, b.y1 - b.y0);
      b = {std::max(b.x0 - room, -1.0F), std::min(b.x1 + room, 1.0F), std::max(b.y0 - room, -1.0F),
           std::min(b.y1 + room, 1.0F), b.rays};
      area += static_cast<double>(b.x1 - b.x0) * static_cast<double>(b.y1 - b.y0);
      longest = std::max({longest, b.x1 - b.x0, b.y1 - b.y0});
    }
    const double finest = std::sqrt(area / (0.25 * most_cells));
    spacing = std::sqrt(area / static_cast<double>(count));
    const double edge = std::clamp(wanted, std::sqrt(fewest) * spacing, std::sqrt(most) * spacing);
    cell = static_cast<float>(std::max({edge, finest, static_cast<double>(longest) / 4096.0, 1e-4}));
    cells = 0;
    for (std::size_t i = 0; i != faces; ++i) {
      const box& b = boxes[i];
      direction_window& w = window[i];
      const auto axis = static_cast<int>(i / 2);
      w.axes = {axes[static_cast<std::size_t>(axis_x(axis))], axes[static_cast<std::size_t>(axis_y(axis))],
                axes[static_cast<std::size_t>(axis)]};
      if (i % 2 != 0)
        for (float& c : w.axes[2]) c = -c;
      w.width = w.height = w.stride = 0;
      w.begin = cells;
      if (b.rays == 0) continue;
      w.min_x = b.x0;
      w.min_y = b.y0;
      w.width = 1 + static_cast<std::int32_t>((b.x1 - b.x0) / cell);
      w.height = 1 + static_cast<std::int32_t>((b.y1 - b.y0) / cell);
      w.stride = (w.width + 2 * direction_window::padding - 1) & ~15;
      cells += static_cast<std::uint32_t>(w.stride) * static_cast<std::uint32_t>(w.height) + direction_window::padding;
    }
  }
  /// Cube axes that are the x and y axes of the faces perpendicular to `axis`.
  [[nodiscard]] static constexpr int axis_x(int axis) noexcept { return axis == 0 ? 1 : 0; }
  [[nodiscard]] static constexpr int axis_y(int axis) noexcept { return axis == 2 ? 1 : 2; }

 private:
  /// Rotation from the world frame to the cube; arbitrary if the rays point in all directions.
  [[nodiscard]] static mat3 cube_rotation(const std::vector<vec3>& directions) {
    vec3 mean = zeros<vec3>();
    mat3 moments = zeros<mat3>();
    for (const vec3& d : directions) {
      mean += d;
      moments += d * transposed(d);
    }
    if (!(norm(mean) > 0.6 * static_cast<double>(directions.size()))) return identity<mat3>();
    mean.normalize();
    // Perpendicular to the mean, the rays have their largest spread along a side of the image.
    const mat3 across = identity<mat3>() - mean * transposed(mean);
    const symmetric_eigen<3> spread = eigen_of_symmetric<3>(across * moments * across);
    vec3 x = across * column_of(spread.vectors, 2);
    if (squared_norm(x) < 0.5) x = mean.unitOrthogonal();  // the rays are parallel up to rounding: any direction works
    x.normalize();
    mat3 turned;
    turned << transposed(x), transposed(cross(mean, x)), transposed(mean);
    return turned;
  }
};
using direction_windows = basic_direction_windows<>;

}  // namespace orbis::octree::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The point cloud that readers and mappers return. Algorithms take any `point_range`.
#pragma once

#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/types.hpp>

namespace orbis {

/// Points in metres, with optional colours.
struct point_cloud {
  std::vector<vec3f> points;
  std::vector<rgb8> colors;  ///< empty, or one per point

  [[nodiscard]] std::size_t size() const noexcept { return points.size(); }
  [[nodiscard]] bool empty() const noexcept { return points.empty(); }
  [[nodiscard]] bool has_colors() const noexcept { return !colors.empty(); }
};

}  // namespace orbis

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The cloud that readers and mappers return. Algorithms take any `point_range`.
#pragma once

#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/types.hpp>

namespace orbis {

/// Points in metres, and a colour for each of them or none at all.
struct point_cloud {
  std::vector<vec3f> points;
  std::vector<rgb8> colors;  ///< empty, or as many as points

  [[nodiscard]] std::size_t size() const noexcept { return points.size(); }
  [[nodiscard]] bool empty() const noexcept { return points.empty(); }
  [[nodiscard]] bool has_colors() const noexcept { return !colors.empty(); }
};

}  // namespace orbis

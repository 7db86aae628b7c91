// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Parts of a cloud: points with given indices, points inside a box, and the treatment of non-finite points.
#pragma once

#include <cassert>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <orbis/core/point.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/types.hpp>

namespace orbis::cloud {

/// Treatment of non-finite points by a filter. The filter's statistics never include them.
enum class non_finite {
  drop,  ///< non-finite points count as outliers
  keep   ///< non-finite points count as inliers, so that an organised cloud keeps its structure
};

/// Copies the points with the given indices, in the order of the indices, and their colours if there are any.
/// @pre every index < cloud.size()
[[nodiscard]] inline point_cloud extract(const point_cloud& cloud, std::span<const std::uint32_t> indices) {
  point_cloud out;
  out.points.reserve(indices.size());
  if (cloud.has_colors()) out.colors.reserve(indices.size());
  for (const std::uint32_t i : indices) {
    assert(i < cloud.size());
    out.points.push_back(cloud.points[i]);
    if (cloud.has_colors()) out.colors.push_back(cloud.colors[i]);
  }
  return out;
}

/// An axis-aligned box, including its faces; unlimited by default.
struct pass_through_options {
  vec3 low = filled<vec3>(-std::numeric_limits<double>::infinity());  ///< metres
  vec3 high = filled<vec3>(std::numeric_limits<double>::infinity());  ///< metres
};

/// Returns the indices, ascending, of the finite points inside the box. O(n).
template <point_range Points>
[[nodiscard]] std::vector<std::uint32_t> pass_through_inliers(const Points& points,
                                                              const pass_through_options& options = {}) {
  std::vector<std::uint32_t> inliers;
  std::uint32_t i = 0;
  for (const auto& point : points) {
    const auto p = coordinates<double>(point);
    const bool inside = p[0] >= options.low.x() && p[0] <= options.high.x() && p[1] >= options.low.y() &&
                        p[1] <= options.high.y() && p[2] >= options.low.z() && p[2] <= options.high.z();
    if (inside && is_finite(point)) inliers.push_back(i);
    ++i;
  }
  return inliers;
}

}  // namespace orbis::cloud

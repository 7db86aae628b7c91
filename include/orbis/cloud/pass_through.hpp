// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Points inside a box.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/core/point.hpp>
#include <orbis/core/types.hpp>

namespace orbis::cloud {

/// A box along the axes, its faces included; unlimited by default.
struct pass_through_options {
  vec3 low = vec3::Constant(-std::numeric_limits<double>::infinity());  ///< metres
  vec3 high = vec3::Constant(std::numeric_limits<double>::infinity());  ///< metres
};

/// The indices, ascending, of the finite points inside the box. O(n).
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

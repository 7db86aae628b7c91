// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Radius outlier removal: removes points with too few neighbours within a radius.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/cloud/extract.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud {

struct radius_options {
  double radius = 0.05;           ///< metres, inclusive; >= 0
  std::size_t min_neighbors = 5;  ///< not counting the point itself
  cloud::non_finite non_finite = cloud::non_finite::drop;
};

namespace detail {

/// `radius_inliers` on a type-erased cloud.
template <execution_policy Policy>
[[nodiscard]] std::vector<std::uint32_t> find_radius_inliers(const Policy& policy, const point_view& points,
                                                             const radius_options& options);

}  // namespace detail

/// Returns the indices, ascending, of the points with at least `min_neighbors` other points within `radius`. O(n (log n
/// + min_neighbors)), even with many identical points; the same result for every policy and processor. Coordinates are
/// converted to float; squared distances are computed in float.
/// @pre radius >= 0, fewer than 2^32 points
template <execution_policy Policy, point_range Points>
[[nodiscard]] std::vector<std::uint32_t> radius_inliers(const Policy& policy, const Points& points,
                                                        const radius_options& options = {}) {
  assert(options.radius >= 0);
  return detail::find_radius_inliers(detail::as_parallel(policy), detail::viewed_points{points}, options);
}

}  // namespace orbis::cloud

#ifndef ORBIS_COMPILED
#include <orbis/cloud/radius-inl.hpp>
#endif

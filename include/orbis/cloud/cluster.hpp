// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Removal of small isolated groups of points that are dense enough to pass every density test but far from the
/// surface.
///
/// Points are linked to neighbours within a few times their spacing; linked points form components. A component is
/// removed if it is small and separated from the large ones by many local spacings.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/cloud/extract.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud {

struct cluster_options {
  std::size_t neighbors = 12;  ///< number of nearest neighbours of each point that can be linked to it; > 0
  /// Maximum length of a link, in multiples of the spacing (mean distance to the neighbours) at each of its two points.
  double reach = 3.0;
  /// Components with fewer points count as small. 0: 1/250 of the number of points, at least 30 and at most 200.
  std::size_t min_size = 0;
  /// A small component is kept if it is not farther than this from a large one, in multiples of the local spacing: the
  /// spacing at the nearest point of the large component, or that in the small component if that is larger.
  double min_gap = 6.0;
  cloud::non_finite non_finite = cloud::non_finite::drop;
};

/// Result of the cluster filter: the inliers, the components, and which of them are removed.
struct cluster_result {
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

  std::vector<std::uint32_t> inliers;    ///< indices, ascending
  std::vector<std::uint32_t> component;  ///< component of each point, or `none`; ordered by their first points
  std::vector<std::uint32_t> sizes;      ///< number of points of each component
  std::vector<char> removed;             ///< for each component, nonzero if it is removed
  std::size_t min_size = 0;              ///< the `min_size` that was applied
};

namespace detail {

/// `cluster_filter` on a type-erased cloud.
template <execution_policy Policy>
[[nodiscard]] cluster_result filter_clusters(const Policy& policy, const point_view& points,
                                             const cluster_options& options);

}  // namespace detail

/// Finds the points that `cluster_inliers` returns, and the components of the neighbour graph.
template <execution_policy Policy, point_range Points>
[[nodiscard]] cluster_result cluster_filter(const Policy& policy, const Points& points,
                                            const cluster_options& options = {}) {
  assert(options.neighbors > 0);
  return detail::filter_clusters(detail::as_parallel(policy), detail::viewed_points{points}, options);
}

/// Returns the indices, ascending, of all points except those in small components of the neighbour graph that are far
/// from every large component. Returns all points if no component is large. O(n (log n + k)); the same result for every
/// policy.
/// @pre neighbors > 0, reach >= 0, min_gap >= 0, fewer than 2^32 - 1 points
template <execution_policy Policy, point_range Points>
[[nodiscard]] std::vector<std::uint32_t> cluster_inliers(const Policy& policy, const Points& points,
                                                         const cluster_options& options = {}) {
  return cluster_filter(policy, points, options).inliers;
}

}  // namespace orbis::cloud

#ifndef ORBIS_COMPILED
#include <orbis/cloud/cluster-inl.hpp>
#endif

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Small groups of points that hang in the air: dense enough for every test of density, but apart from
/// the surface.
///
/// Points are linked with those of their neighbours that are no further than a few times their spacing;
/// linked points make components. A component that is small, and separated from the large ones by many
/// local spacings, goes.
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
  std::size_t neighbors = 12;  ///< of each point that can be linked with it; > 0
  /// Linked up to this many times the spacing of both: the mean distance to the neighbours.
  double reach = 3.0;
  /// Components of fewer points are small. 0: a 250th of the points, but 30 at least and 200 at most.
  std::size_t min_size = 0;
  /// Small components further from every large one than this many local spacings go: the spacing of the
  /// large one where it is nearest, or that within the small one if it is wider.
  double min_gap = 6.0;
  cloud::non_finite non_finite = cloud::non_finite::drop;
};

/// The components and which of them go.
struct cluster_result {
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

  std::vector<std::uint32_t> inliers;    ///< indices, ascending
  std::vector<std::uint32_t> component;  ///< per point, numbered by their first points; `none` where it is in none
  std::vector<std::uint32_t> sizes;      ///< points of each component
  std::vector<char> removed;             ///< for each component: whether it goes
  std::size_t min_size = 0;              ///< as it was applied
};

namespace detail {

/// `cluster_filter` for any points.
template <execution_policy Policy>
[[nodiscard]] cluster_result filter_clusters(const Policy& policy, const point_view& points,
                                             const cluster_options& options);

}  // namespace detail

/// Finds the points that `cluster_inliers` returns, and the components they are in.
template <execution_policy Policy, point_range Points>
[[nodiscard]] cluster_result cluster_filter(const Policy& policy, const Points& points,
                                            const cluster_options& options = {}) {
  assert(options.neighbors > 0);
  return detail::filter_clusters(detail::threads_of(policy), detail::viewed_points{points}, options);
}

/// The indices, ascending, of the points that are not in a small component of the neighbour graph far from
/// every large one; of all points where no component is large. O(n (log n + k)); the same result for every
/// policy. @pre neighbors > 0, reach >= 0, min_gap >= 0, fewer than 2^32 - 1 points
template <execution_policy Policy, point_range Points>
[[nodiscard]] std::vector<std::uint32_t> cluster_inliers(const Policy& policy, const Points& points,
                                                         const cluster_options& options = {}) {
  return cluster_filter(policy, points, options).inliers;
}

}  // namespace orbis::cloud

#ifndef ORBIS_COMPILED
#include <orbis/cloud/cluster-inl.hpp>
#endif

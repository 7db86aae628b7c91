// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The k nearest neighbours of every point of a cloud, and the mean distance to them.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/cloud/neighbors.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud {

/// The neighbours of every point of a cloud, nearest first.
struct neighbor_table {
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

  std::size_t width = 0;              ///< number of neighbours of each finite point
  std::size_t points = 0;             ///< number of points in the cloud, finite or not; also the number of rows
  std::vector<neighbor<float>> rows;  ///< `width` entries per point; index `none` for non-finite points

  /// Returns the neighbours of point `i`; empty if the point is not finite.
  [[nodiscard]] std::span<const neighbor<float>> operator[](std::size_t i) const noexcept {
    if (width == 0 || rows[i * width].index == none) return {};
    return std::span{rows}.subspan(i * width, width);
  }
};

namespace detail {

/// `all_knn` and `all_mean_knn_distance` on a type-erased cloud.
template <execution_policy Policy>
[[nodiscard]] neighbor_table find_all_knn(const Policy& policy, const point_view& points, std::size_t k);
template <execution_policy Policy>
[[nodiscard]] std::vector<float> find_mean_distances(const Policy& policy, const point_view& points, std::size_t k);

}  // namespace detail

/// Finds the `min(k, finite points - 1)` nearest other points of every finite point, nearest first. Points at equal
/// squared distances are ordered by index, so the result is the same for every policy and processor. Identical points
/// are neighbours of each other.
///
/// Coordinates are converted to float, and distances are computed in float. O(n (log n + k log k)), even with many
/// identical points. Memory: 8 k bytes per point for the result, 40 bytes per point during the call, and 12 more if the
/// points are not contiguous floats.
/// @pre k > 0, fewer than 2^32 - 1 points
template <execution_policy Policy, point_range Points>
[[nodiscard]] neighbor_table all_knn(const Policy& policy, const Points& points, std::size_t k) {
  assert(k > 0);
  return detail::find_all_knn(detail::as_parallel(policy), detail::viewed_points{points}, k);
}

/// Computes for each point the mean distance in metres to its `k` nearest other points, or to all others if there are
/// fewer than `k`. The result is NaN for non-finite points, and for a finite point if there is no other.
///
/// Coordinates are converted to float. Squared distances are computed in float; their roots are computed in double and
/// summed in ascending order; the mean is rounded to float. The result equals, bit for bit, the mean distances of the
/// usual statistical outlier filter. O(n log n) for fixed k, even with many identical points; the same result for every
/// policy and processor. Memory: about 40 bytes per point, and 0.45 k + 42 kilobytes per thread.
/// @pre k > 0, fewer than 2^32 points
template <execution_policy Policy, point_range Points>
[[nodiscard]] std::vector<float> all_mean_knn_distance(const Policy& policy, const Points& points, std::size_t k) {
  assert(k > 0);
  return detail::find_mean_distances(detail::as_parallel(policy), detail::viewed_points{points}, k);
}

}  // namespace orbis::cloud

#ifndef ORBIS_COMPILED
#include <orbis/cloud/all_knn-inl.hpp>
#endif

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The k nearest neighbours of every point of a cloud, and the mean distance to them.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <ranges>
#include <span>
#include <vector>

#include <orbis/cloud/detail/knn/leaf_hierarchy.hpp>
#include <orbis/cloud/detail/knn/nearest_search.hpp>
#include <orbis/cloud/detail/knn/neighbor_rows.hpp>
#include <orbis/cloud/detail/knn/reported_chunks.hpp>
#include <orbis/cloud/neighbors.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/result.hpp>

namespace orbis::cloud {

/// The neighbours of every point of a cloud, nearest first.
struct neighbor_table {
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

  std::size_t width = 0;              ///< neighbours of each finite point
  std::size_t points = 0;             ///< of the cloud, finite or not: as many rows
  std::vector<neighbor<float>> rows;  ///< `width` per point; index `none` in rows of points that are not finite

  /// The neighbours of point `i`; none if it is not finite.
  [[nodiscard]] std::span<const neighbor<float>> operator[](std::size_t i) const noexcept {
    if (width == 0 || rows[i * width].index == none) return {};
    return std::span{rows}.subspan(i * width, width);
  }
};

/// The `min(k, finite points - 1)` nearest other points of every finite point, nearest first; points
/// at equal squared distances by index, so that the result is one and the same for every policy and
/// processor. Identical points are neighbours of each other. `on_progress` counts leaves of sixteen points.
///
/// Coordinates are taken as float, distances are computed in float. O(n (log n + k log k)), also where
/// many points are identical. Memory: 8 k bytes per point for the result, 40 per point meanwhile.
/// Errors: `cancelled`, if the callback asks to stop.
/// @pre k > 0, fewer than 2^32 - 1 points
template <execution_policy Policy, point_range Points>
[[nodiscard]] result<neighbor_table> all_knn(const Policy& policy, const Points& points, std::size_t k,
                                             progress on_progress) {
  assert(k > 0);
  const std::size_t count = std::ranges::size(points);
  const detail::leaf_hierarchy tree = detail::make_leaves(policy, points, std::min(k, count) + 1);
  neighbor_table out;
  out.points = count;
  out.width = std::min(k, std::max<std::size_t>(tree.finite, 1) - 1);
  out.rows.assign(count * out.width, {neighbor_table::none, std::numeric_limits<float>::quiet_NaN()});
  if (out.width == 0) return out;
  const detail::knn_kernels kernels;
  const auto row_of = [&](std::uint32_t i) { return std::span{out.rows}.subspan(i * out.width, out.width); };
  const bool whole =
      detail::for_each_reported_chunk(policy, tree.leaves.size(), 128, on_progress, [&](auto begin, auto end) {
        detail::find_neighbor_rows(
            tree, kernels, out.width, begin, end,
            [&](std::size_t l, std::size_t i) { return row_of(tree.members[l * detail::leaf_width + i]); },
            [](std::size_t) {});
      });
  if (!whole) return detail::fail_cancelled();
  // Those left out have the first of their copies for neighbours.
  for (const detail::surplus_copy& copy : tree.left_out) {
    const auto row = row_of(copy.index);
    for (std::size_t n = 0; n != row.size(); ++n) row[n] = {tree.members[copy.kept + n], 0.0F};
  }
  return out;
}
/// The nearest neighbours of every point as above, without a callback: cannot fail.
template <execution_policy Policy, point_range Points>
[[nodiscard]] neighbor_table all_knn(const Policy& policy, const Points& points, std::size_t k) {
  return *all_knn(policy, points, k, progress{});
}

namespace detail {

/// `float(sum / divisor)`, where `sum` adds the roots in ascending order in double. The order only
/// matters where a rounding border of float lies within the error of the sum, so they are sorted
/// only there.
[[nodiscard]] inline float mean_root(std::span<float> squared, double divisor) {
  double sum = 0;
  for (const float s : squared) sum += std::sqrt(double{s});
  const double slack = 4.0 * static_cast<double>(squared.size()) * std::numeric_limits<double>::epsilon();
  const auto low = static_cast<float>(sum * (1 - slack) / divisor);
  const auto high = static_cast<float>(sum * (1 + slack) / divisor);
  if (low == high) return low;
  std::sort(squared.begin(), squared.end());
  sum = 0;
  for (const float s : squared) sum += std::sqrt(double{s});
  return static_cast<float>(sum / divisor);
}

/// The mean of the roots of all but the smallest (the point itself) of the `wanted` smallest of `found`, whose sum is
/// known as far as `nearest_sum` says. Infinity where there are not that many: their squares overflow.
[[nodiscard]] inline float mean_of_nearest(const nearest_sum& sum, std::span<float> found, std::size_t wanted) {
  if (found.size() < wanted) return std::numeric_limits<float>::infinity();
  const auto divisor = static_cast<double>(wanted - 1);
  const double slack = roots_slack(wanted);
  const auto low = static_cast<float>(sum.roots * (1 - slack) / divisor);
  if (sum.roots >= 0 && low == static_cast<float>(sum.roots * (1 + slack) / divisor)) return low;
  std::nth_element(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(wanted - 1), found.end());
  return mean_root(found.first(wanted), divisor);
}

}  // namespace detail

/// For each point the mean distance in metres to its `k` nearest other points; to all others where
/// there are fewer than `k`. NaN for points that are not finite, and for a point that is alone.
/// `on_progress` counts leaves of sixteen points.
///
/// Coordinates are taken as float. Squared distances are float, roots and sums double in ascending
/// order, the mean float: bit for bit the mean distances of the usual statistical outlier filter.
/// O(n log n) for fixed k, also where many points are identical; the same result for every policy and
/// processor. Memory: about 40 bytes per point, and 0.45 k + 42 kilobytes per thread.
/// Errors: `cancelled`, if the callback asks to stop.
/// @pre k > 0, fewer than 2^32 points
template <execution_policy Policy, point_range Points>
[[nodiscard]] result<std::vector<float>> all_mean_knn_distance(const Policy& policy, const Points& points,
                                                               std::size_t k, progress on_progress) {
  assert(k > 0);
  std::vector<float> means(std::ranges::size(points), std::numeric_limits<float>::quiet_NaN());
  const detail::leaf_hierarchy tree = detail::make_leaves(policy, points, std::min(k, means.size()) + 1);
  const std::size_t wanted = std::min(k, std::max<std::size_t>(tree.finite, 1) - 1) + 1;  // with the point itself
  if (wanted < 2) return means;
  for (const detail::surplus_copy& copy : tree.left_out) means[copy.index] = 0;
  const detail::knn_kernels kernels;
  const bool whole =
      detail::for_each_reported_chunk(policy, tree.leaves.size(), 128, on_progress, [&](auto begin, auto end) {
        detail::nearest_search search{tree, kernels, wanted};
        for (std::size_t l = begin; l != end; ++l) {
          search.visit_sums(l, [&](std::size_t i, std::span<float> found, const detail::nearest_sum& sum) {
            means[tree.members[l * detail::leaf_width + i]] = detail::mean_of_nearest(sum, found, wanted);
          });
        }
      });
  if (!whole) return detail::fail_cancelled();
  return means;
}
/// The mean distances as above, without a callback: cannot fail.
template <execution_policy Policy, point_range Points>
[[nodiscard]] std::vector<float> all_mean_knn_distance(const Policy& policy, const Points& points, std::size_t k) {
  return *all_mean_knn_distance(policy, points, k, progress{});
}

/// For each point the mean distance in metres to the first `k` neighbours of its row, or to all of a
/// shorter row; NaN where there are none. So one table serves every k up to its width. The table holds
/// rounded roots: the means are those of `all_mean_knn_distance` to within a rounding, not bit for bit.
/// O(n k). @pre k > 0
template <execution_policy Policy>
[[nodiscard]] std::vector<float> mean_knn_distance(const Policy& policy, const neighbor_table& table, std::size_t k) {
  assert(k > 0);
  const std::size_t width = std::min(k, table.width);
  std::vector<float> means(table.points, std::numeric_limits<float>::quiet_NaN());
  if (width == 0) return means;
  for_each_index(policy, table.points, 4096, [&](std::size_t i) {
    const neighbor<float>* const row = table.rows.data() + i * table.width;
    if (row->index == neighbor_table::none) return;
    double sum = 0;
    for (std::size_t n = 0; n != width; ++n) sum += row[n].distance;
    means[i] = static_cast<float>(sum / static_cast<double>(width));
  });
  return means;
}

}  // namespace orbis::cloud

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of all_knn.hpp.
#pragma once

#include <algorithm>
#include <cmath>

#include <orbis/cloud/all_knn.hpp>
#include <orbis/cloud/detail/knn/knn_kernels.hpp>
#include <orbis/cloud/detail/knn/leaf_hierarchy.hpp>
#include <orbis/cloud/detail/knn/nearest_search.hpp>
#include <orbis/cloud/detail/knn/neighbor_rows.hpp>

namespace orbis::cloud {

namespace detail {

template <execution_policy Policy>
neighbor_table find_all_knn(const Policy& policy, const point_view& points, std::size_t k) {
  const std::size_t count = points.size();
  const leaf_hierarchy tree = make_leaves(policy, points, std::min(k, count) + 1);
  neighbor_table out;
  out.points = count;
  out.width = std::min(k, std::max<std::size_t>(tree.finite, 1) - 1);
  out.rows.assign(count * out.width, {neighbor_table::none, std::numeric_limits<float>::quiet_NaN()});
  if (out.width == 0) return out;
  const knn_kernels kernels;
  const auto row_of = [&](std::uint32_t i) { return std::span{out.rows}.subspan(i * out.width, out.width); };
  for_each_chunk(policy, tree.leaves.size(), 128, [&](auto begin, auto end) {
    find_neighbor_rows(
        tree, kernels, out.width, begin, end,
        [&](std::size_t l, std::size_t i) { return row_of(tree.members[l * leaf_width + i]); }, [](std::size_t) {});
  });
  // The nearest neighbours of a point that is in no leaf are its copies in the leaves; enough of them exist.
  for (const surplus_copy& copy : tree.left_out) {
    const auto row = row_of(copy.index);
    for (std::size_t n = 0; n != row.size(); ++n) row[n] = {tree.members[copy.kept + n], 0.0F};
  }
  return out;
}

/// `float(sum / divisor)`, where `sum` adds the square roots in ascending order in double. The order affects the result
/// only if a rounding boundary of float is within the error of the sum, so the roots are sorted only in that case.
[[nodiscard]] inline float mean_root(std::span<float> squared, double divisor) {
  double sum = 0;
  for (const float s : squared) sum += std::sqrt(double{s});
  const double slack = 4.0 * static_cast<double>(squared.size()) * std::numeric_limits<double>::epsilon();
  const auto low = static_cast<float>(sum * (1 - slack) / divisor);
  const auto high = static_cast<float>(sum * (1 + slack) / divisor);
  if (low == high) return low;
  std::sort(squared.data(), squared.data() + squared.size());
  sum = 0;
  for (const float s : squared) sum += std::sqrt(double{s});
  return static_cast<float>(sum / divisor);
}

/// Mean distance from a point to its `wanted` - 1 nearest others. `found`: squared distances, including that of the
/// point to itself. `sum`: the approximate sum of their roots, which is used unless it is unknown or its error affects
/// the rounded mean. Infinity if fewer than `wanted` were found, which happens if squared distances overflow.
[[nodiscard]] inline float mean_of_nearest(const nearest_sum& sum, std::span<float> found, std::size_t wanted) {
  if (found.size() < wanted) return std::numeric_limits<float>::infinity();
  const auto divisor = static_cast<double>(wanted - 1);
  const double slack = roots_slack(wanted);
  const auto low = static_cast<float>(sum.roots * (1 - slack) / divisor);
  if (sum.roots >= 0 && low == static_cast<float>(sum.roots * (1 + slack) / divisor)) return low;
  std::nth_element(found.data(), found.data() + (wanted - 1), found.data() + found.size());
  return mean_root(found.first(wanted), divisor);
}

template <execution_policy Policy>
std::vector<float> find_mean_distances(const Policy& policy, const point_view& points, std::size_t k) {
  std::vector<float> means(points.size(), std::numeric_limits<float>::quiet_NaN());
  const leaf_hierarchy tree = make_leaves(policy, points, std::min(k, means.size()) + 1);
  const std::size_t wanted = std::min(k, std::max<std::size_t>(tree.finite, 1) - 1) + 1;  // including the point itself
  if (wanted < 2) return means;
  for (const surplus_copy& copy : tree.left_out) means[copy.index] = 0;
  const knn_kernels kernels;
  for_each_chunk(policy, tree.leaves.size(), 128, [&](auto begin, auto end) {
    nearest_search search{tree, kernels, wanted};
    for (std::size_t l = begin; l != end; ++l) {
      search.visit_sums(l, [&](std::size_t i, std::span<float> found, const nearest_sum& sum) {
        means[tree.members[l * leaf_width + i]] = mean_of_nearest(sum, found, wanted);
      });
    }
  });
  return means;
}

}  // namespace detail

}  // namespace orbis::cloud

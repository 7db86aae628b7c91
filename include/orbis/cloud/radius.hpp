// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Radius outlier removal: points with too few neighbours close by.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/cloud/all_knn_kernels.hpp>
#include <orbis/cloud/all_knn_leaves.hpp>
#include <orbis/cloud/all_knn_search.hpp>
#include <orbis/cloud/decision.hpp>
#include <orbis/cloud/squared_distance.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/simd.hpp>

namespace orbis::cloud {

struct radius_options {
  double radius = 0.05;           ///< metres, the border included; >= 0
  std::size_t min_neighbors = 5;  ///< the point itself not counted
  cloud::non_finite non_finite = cloud::non_finite::drop;
};

namespace detail {

/// Says of the points of one leaf after another whether enough points lie within a radius.
class crowd_search {
 public:
  /// `enough`: with the point itself.
  crowd_search(const leaf_hierarchy& tree, const knn_kernels& kernels, float radius, std::size_t enough)
      : tree_{&tree}, kernels_{kernels}, bound_{radius * radius}, enough_{enough} {}

  /// Calls `f(i, has_enough)` for the points of one leaf.
  template <class F>
  void visit_leaf(std::size_t l, F&& f) {
    const std::size_t size = tree_->size_of(l);
    const box_row& boxes = tree_->levels[0][l / leaf_width];
    const std::size_t place = l % leaf_width;
    // No two points of a box are further apart than its corners, rounding included.
    const bool all_near =
        squared_distance<float>({boxes.low[0][place], boxes.low[1][place], boxes.low[2][place]},
                                {boxes.high[0][place], boxes.high[1][place], boxes.high[2][place]}) <= bound_;
    for (std::size_t i = 0; i != size; ++i)
      f(i, (all_near && size >= enough_) || has_enough(l, i, all_near ? size : 0));
  }

 private:
  /// `own`: how many of its own leaf are known to be near; 0: not known.
  [[nodiscard]] bool has_enough(std::size_t l, std::size_t i, std::size_t own) {
    const point_row& leaf = tree_->leaves[l];
    const std::array<float, 3> q{leaf.axis[0][i], leaf.axis[1][i], leaf.axis[2][i]};
    std::size_t count = own != 0 ? own : within(l, q);
    if (count >= enough_) return true;
    const box3 box{q, q};
    std::array<float, leaf_width> distance;
    pending_.clear();
    pending_.push_back({static_cast<std::uint32_t>(tree_->levels.size() - 1), 0});
    while (!pending_.empty()) {
      const node next = pending_.back();
      pending_.pop_back();
      const std::size_t children = next.level == 0 ? tree_->leaves.size() : tree_->levels[next.level - 1].size();
      std::uint32_t mask = kernels_.near_boxes(tree_->levels[next.level][next.row], box, bound_, distance.data());
      for (; mask != 0; mask &= mask - 1) {
        const std::size_t child = next.row * leaf_width + static_cast<std::size_t>(std::countr_zero(mask));
        if (child >= children) break;  // where the bound is infinite
        if (next.level != 0) {
          pending_.push_back({next.level - 1, static_cast<std::uint32_t>(child)});
        } else if (child != l) {
          count += within(child, q);
          if (count >= enough_) return true;
        }
      }
    }
    return false;
  }
  [[nodiscard]] std::size_t within(std::size_t l, const std::array<float, 3>& q) const {
    std::array<float, leaf_width> distance;
    const std::uint32_t mask = kernels_.distances(tree_->leaves[l], q, bound_, distance.data());
    const std::uint32_t there = (1U << tree_->size_of(l)) - 1;  // counts where the bound is infinite
    return static_cast<std::size_t>(std::popcount(mask & there));
  }

  struct node {
    std::uint32_t level;
    std::uint32_t row;
  };
  const leaf_hierarchy* tree_;
  knn_kernels kernels_;
  float bound_;
  std::size_t enough_;
  std::vector<node> pending_;
};

/// `radius_inliers` with the inner loops for `level`.
template <execution_policy Policy, point_range Points>
[[nodiscard]] std::vector<std::uint32_t> radius_inliers_at(simd::level level, const Policy& policy,
                                                           const Points& points, const radius_options& options) {
  assert(options.radius >= 0);
  const std::size_t count = std::ranges::size(points);
  const std::size_t enough = std::min(options.min_neighbors, count) + 1;  // with the point itself
  const leaf_hierarchy tree = make_leaves(policy, points, enough);
  std::vector<char> kept(count, options.non_finite == cloud::non_finite::keep ? 1 : 0);
  const knn_kernels kernels = select_knn_kernels(level);
  for_each_chunk(policy, tree.leaves.size(), 128, [&](std::size_t begin, std::size_t end) {
    crowd_search search{tree, kernels, static_cast<float>(options.radius), enough};
    for (std::size_t l = begin; l != end; ++l) {
      search.visit_leaf(
          l, [&](std::size_t i, bool has_enough) { kept[tree.members[l * leaf_width + i]] = has_enough ? 1 : 0; });
    }
  });
  // Enough copies of those left out are in the leaves.
  for (const surplus_copy& copy : tree.left_out) kept[copy.index] = 1;
  return indices_where(count, [&](std::size_t i) { return kept[i] != 0; });
}

}  // namespace detail

/// The indices, ascending, of the points with at least `min_neighbors` other points within `radius`.
/// O(n (log n + min_neighbors)), also where many points are identical; the same result for every policy and
/// processor. Coordinates are taken as float, squared distances computed in float.
/// @pre radius >= 0, fewer than 2^32 points
template <execution_policy Policy, point_range Points>
[[nodiscard]] std::vector<std::uint32_t> radius_inliers(const Policy& policy, const Points& points,
                                                        const radius_options& options = {}) {
  return detail::radius_inliers_at(simd::detected(), policy, points, options);
}

}  // namespace orbis::cloud

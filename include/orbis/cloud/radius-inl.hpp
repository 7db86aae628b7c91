// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of radius.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include <orbis/cloud/detail/knn/knn_kernels.hpp>
#include <orbis/cloud/detail/knn/leaf_hierarchy.hpp>
#include <orbis/cloud/detail/knn/nearest_search.hpp>
#include <orbis/cloud/detail/knn/squared_distance.hpp>
#include <orbis/cloud/detail/select/decision.hpp>
#include <orbis/cloud/radius.hpp>

namespace orbis::cloud {

namespace detail {

/// Decides, one leaf at a time, whether enough points lie within a radius of each point of the leaf.
class crowd_search {
 public:
  /// `enough`: minimum number of points, including the point itself.
  crowd_search(const leaf_hierarchy& tree, const knn_kernels& kernels, float radius, std::size_t enough)
      : tree_{&tree}, kernels_{kernels}, bound_{radius * radius}, enough_{enough}, near_{most_leaves} {
    // Without these lists, points are counted one by one, until enough are found.
    if (std::isfinite(bound_) && enough <= most_found) {
      chosen_.resize(near_.leaves.size() + leaf_width);
      found_.resize(enough + 4 * leaf_width);
    }
  }

  /// Calls `f(i, has_enough)` for the points of one leaf.
  template <class F>
  void visit_leaf(std::size_t l, F&& f) {
    const std::size_t size = tree_->leaf_size(l);
    const box3 box = tree_->levels[0][l / leaf_width].child(l % leaf_width);
    // No two points in a box are further apart than its opposite corners, even after rounding.
    const bool all_near = squared_distance(box.low, box.high) <= bound_;
    bool gathered = false;
    bool usable = !found_.empty();
    for (std::size_t i = 0; i != size; ++i) {
      const point_row& leaf = tree_->leaves[l];
      const std::array<float, 3> q{leaf.axis[0][i], leaf.axis[1][i], leaf.axis[2][i]};
      bool has_enough = (all_near ? size : within(l, q)) >= enough_;
      if (!has_enough && usable && !gathered) {
        usable = gather_near(*tree_, 0, kernels_, box, bound_, open_, near_);
        gathered = usable;
      }
      if (!has_enough) has_enough = usable ? enough_near(q) : enough_anywhere(q);
      f(i, has_enough);
    }
  }

 private:
  static constexpr std::size_t most_leaves = 512;
  static constexpr std::size_t most_found = 4096;

  [[nodiscard]] bool enough_near(const std::array<float, 3>& q) {
    return kernels_.near_point(tree_->leaves.data(), near_, q, bound_, chosen_.data(), found_.data(), nullptr,
                               enough_ - 1) >= enough_;
  }
  [[nodiscard]] bool enough_anywhere(const std::array<float, 3>& q) {
    std::size_t count = 0;
    for_each_within(*tree_, kernels_, q, bound_, open_, [&](std::uint32_t, float) { return ++count < enough_; });
    return count >= enough_;
  }
  [[nodiscard]] std::size_t within(std::size_t l, const std::array<float, 3>& q) const {
    std::array<float, leaf_width> distance;
    const std::uint32_t mask = kernels_.distances(tree_->leaves[l], q, bound_, distance.data());
    const std::uint32_t there = (1U << tree_->leaf_size(l)) - 1;  // masks out the padding if the bound is infinite
    return static_cast<std::size_t>(std::popcount(mask & there));
  }

  const leaf_hierarchy* tree_;
  knn_kernels kernels_;
  float bound_;
  std::size_t enough_;
  nearby_leaves near_;
  std::vector<open_row> open_;
  line_vector<std::uint32_t> chosen_;
  line_vector<float> found_;
};

template <execution_policy Policy>
std::vector<std::uint32_t> find_radius_inliers(const Policy& policy, const point_view& points,
                                               const radius_options& options) {
  const std::size_t count = points.size();
  const std::size_t enough = std::min(options.min_neighbors, count) + 1;  // including the point itself
  const leaf_hierarchy tree = make_leaves(policy, points, enough);
  std::vector<char> kept(count, options.non_finite == cloud::non_finite::keep ? 1 : 0);
  const knn_kernels kernels;
  for_each_chunk(policy, tree.leaves.size(), 128, [&](auto begin, auto end) {
    crowd_search search{tree, kernels, static_cast<float>(options.radius), enough};
    for (std::size_t l = begin; l != end; ++l) {
      search.visit_leaf(
          l, [&](std::size_t i, bool has_enough) { kept[tree.members[l * leaf_width + i]] = has_enough ? 1 : 0; });
    }
  });
  // Each point that is in no leaf has enough copies in the leaves.
  for (const surplus_copy& copy : tree.left_out) kept[copy.index] = 1;
  return indices_where(count, [&](std::size_t i) { return kept[i] != 0; });
}

}  // namespace detail

}  // namespace orbis::cloud

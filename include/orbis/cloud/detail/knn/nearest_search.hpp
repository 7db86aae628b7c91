// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Search for the nearest neighbours of all points of a cloud, leaf by leaf.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <orbis/cloud/detail/knn/knn_kernels.hpp>
#include <orbis/cloud/detail/knn/leaf_hierarchy.hpp>
#include <orbis/cloud/detail/knn/squared_distance.hpp>

namespace orbis::cloud::detail {

/// A row of boxes that has not been visited yet.
struct open_row {
  std::uint32_t level;
  std::uint32_t row;
};

/// Gathers the leaves (`level` 0), or the rows of the level below `level`, that are within squared distance `bound` of
/// `box`. Returns false if there are too many. `open` is scratch.
template <class = void>
[[nodiscard]] inline bool gather_near(const leaf_hierarchy& tree, std::uint32_t level, const knn_kernels& kernels,
                                      const box3& box, float bound, std::vector<open_row>& open, nearby_leaves& near) {
  near.count = 0;
  open.clear();
  open.push_back({static_cast<std::uint32_t>(tree.levels.size() - 1), 0});
  std::array<float, leaf_width> distance;
  while (!open.empty()) {
    const open_row next = open.back();
    open.pop_back();
    const box_row& boxes = tree.levels[next.level][next.row];
    std::uint32_t mask = kernels.near_boxes(boxes, box, bound, distance.data());
    const auto child = static_cast<std::uint32_t>(next.row * leaf_width);
    if (next.level == level) {
      if (!near.has_room()) return false;
      kernels.gather(boxes, mask, child, near);
    } else {
      for (; mask != 0; mask &= mask - 1) {
        open.push_back({next.level - 1, child + static_cast<std::uint32_t>(std::countr_zero(mask))});
      }
    }
  }
  near.finish();
  return true;
}

/// Calls `f(member, squared distance)` for every point within squared distance `bound` of `q`, until `f` returns false.
/// `open` is scratch.
template <class F>
void for_each_within(const leaf_hierarchy& tree, const knn_kernels& kernels, const std::array<float, 3>& q, float bound,
                     std::vector<open_row>& open, F&& f) {
  const box3 box{q, q};
  std::array<float, leaf_width> distance;
  open.clear();
  open.push_back({static_cast<std::uint32_t>(tree.levels.size() - 1), 0});
  while (!open.empty()) {
    const open_row next = open.back();
    open.pop_back();
    const std::size_t children = next.level == 0 ? tree.leaves.size() : tree.levels[next.level - 1].size();
    std::uint32_t mask = kernels.near_boxes(tree.levels[next.level][next.row], box, bound, distance.data());
    for (; mask != 0; mask &= mask - 1) {
      const std::size_t child = next.row * leaf_width + static_cast<std::size_t>(std::countr_zero(mask));
      if (child >= children) break;  // reached if the bound is infinite
      if (next.level != 0) {
        open.push_back({next.level - 1, static_cast<std::uint32_t>(child)});
        continue;
      }
      std::uint32_t within = kernels.distances(tree.leaves[child], q, bound, distance.data());
      for (const std::size_t size = tree.leaf_size(child); within != 0; within &= within - 1) {
        const auto n = static_cast<std::size_t>(std::countr_zero(within));
        if (n < size && !f(tree.members[child * leaf_width + n], distance[n])) return;
      }
    }
  }
}

/// Finds the squared distances from each point, in the order of the curve, to its `wanted` nearest points, including
/// itself.
///
/// Consecutive points share candidates: the leaves within a little more than the distance that sufficed for the
/// previous points. Each point takes the candidates within a slightly smaller distance. The result is complete if it
/// holds at least `wanted` points. Otherwise, as for outliers and at jumps in density, a separate search is made for
/// the point within the distance that suffices for its neighbours on the curve. If that distance is too large to be
/// useful, leaves are visited in ascending order of distance. A bad guess thus costs only time.
///
/// Source of the search in ascending order of box distance: G. R. Hjaltason, H. Samet, "Distance browsing in spatial
/// databases", ACM TODS 24, 1999.
template <class = void>
class basic_nearest_search {
 public:
  /// Prepares a search. `with_places`: also record the places of the found points. `most_near_rows`: maximum number of
  /// rows of leaves shared by the leaves of a row; affects speed only.
  /// @pre 0 < wanted <= points in the leaves
  basic_nearest_search(const leaf_hierarchy& tree, const knn_kernels& kernels, std::size_t wanted,
                       bool with_places = false, std::size_t most_near_rows = 128)
      : tree_{&tree},
        kernels_{kernels},
        wanted_{wanted},
        capacity_{3 * wanted + 64},
        stride_{(capacity_ / leaf_width + 5) * leaf_width},  // kernels write past the end; rows begin at cache lines
        shared_{192 + 2 * wanted},
        own_{192 + 2 * wanted},
        near_rows_{most_near_rows},
        chosen_(leaf_width * (own_.leaves.size() + leaf_width)),
        found_(leaf_width * stride_),
        places_(with_places ? leaf_width * stride_ : 0),
        hoped_{1.0F + 1.7F / std::sqrt(static_cast<float>(wanted))},
        reach_{1.5F * hoped_} {}

  /// Searches for the points of one leaf, then calls `f(i, found, bound)` for the i-th point, in any order. `found`
  /// holds squared distances up to `bound`, including the nearest, followed by sixteen infinities; it holds fewer than
  /// `wanted` if squared distances overflow. `f` may reorder `found`, and returns the `wanted`-th smallest.
  /// `found_places(i)` returns the places of the found points.
  template <class F>
  void visit_leaf(std::size_t l, F&& f) {
    search_leaf(l, [&](std::size_t first, std::size_t last, const box3& box) {
      search_run(l, first, last, box);
      for (std::size_t i = first; i != last; ++i) largest_[i] = f(i, found_distances(i), bounds_[i]);
    });
  }
  /// Like `visit_leaf`, but also sums the nearest distances and calls `f(i, found, sum)`. `sum` is meaningless if fewer
  /// than `wanted` were found.
  template <class F>
  void visit_sums(std::size_t l, F&& f) {
    std::array<nearest_sum, leaf_width> sums;
    search_leaf(l, [&](std::size_t first, std::size_t last, const box3& box) {
      search_run(l, first, last, box);
      kernels_.sums_of_each(found_.data(), stride_, first, last, counts_.data(), wanted_, bounds_.data(), sums.data());
      for (std::size_t i = first; i != last; ++i) {
        largest_[i] = counts_[i] < wanted_ ? infinity : sums[i].largest_squared;
        f(i, found_distances(i), sums[i]);
      }
    });
  }

  /// Returns the places in `leaf_hierarchy::members` of the points found for the i-th point of the visited leaf, in the
  /// order of `found`; null if unknown, as for outliers.
  [[nodiscard]] const std::uint32_t* found_places(std::size_t i) const noexcept {
    return has_places_[i] ? places_.data() + i * stride_ : nullptr;
  }

  /// Calls `f(member, squared distance)` for every point within `bound` of the i-th point of the visited leaf.
  template <class F>
  void visit_within(std::size_t l, std::size_t i, float bound, F&& f) {
    const std::array<float, 3> q = query(l, i);
    if (!(bound <= shared_reach_)) {
      for_each_within(*tree_, kernels_, q, bound, open_, [&](std::uint32_t member, float d) {
        f(member, d);
        return true;
      });
      return;
    }
    const box3 box{q, q};
    std::array<float, leaf_width> distance;
    for (std::size_t first = 0; first < shared_.count; first += leaf_width) {
      std::uint32_t mask = kernels_.near_boxes(shared_.row(first), box, bound, distance.data());
      for (; mask != 0; mask &= mask - 1) {
        const std::size_t leaf = shared_.leaves[first + static_cast<std::size_t>(std::countr_zero(mask))];
        std::uint32_t within = kernels_.distances(tree_->leaves[leaf], q, bound, distance.data());
        for (; within != 0; within &= within - 1) {
          const auto n = static_cast<std::size_t>(std::countr_zero(within));
          f(tree_->members[leaf * leaf_width + n], distance[n]);
        }
      }
    }
  }

 private:
  /// Number of squared distances found; these include all distances up to `bound`.
  struct found_within {
    std::size_t count;
    float bound;
    bool has_places = false;
  };
  static constexpr float infinity = std::numeric_limits<float>::infinity();
  static constexpr float most = std::numeric_limits<float>::max();
  static constexpr float most_spread = 32;  ///< maximum squared extent of a run of points, relative to `usual_`
  static constexpr float spare = 1.3F;      ///< ratio of the squared search radius for near rows to that for a leaf

  [[nodiscard]] std::array<float, 3> query(std::size_t l, std::size_t i) const noexcept {
    const point_row& leaf = tree_->leaves[l];
    return {leaf.axis[0][i], leaf.axis[1][i], leaf.axis[2][i]};
  }
  /// Extends a box to include a point, unless the box becomes too large for sharing candidates to pay off.
  [[nodiscard]] bool grow(box3& box, const std::array<float, 3>& p) const noexcept {
    box3 grown;
    for (std::size_t a = 0; a != 3; ++a) {
      grown.low[a] = std::min(box.low[a], p[a]);
      grown.high[a] = std::max(box.high[a], p[a]);
    }
    if (squared_distance(grown.low, grown.high) > most_spread * usual_) return false;
    box = grown;
    return true;
  }

  [[nodiscard]] std::span<float> found_distances(std::size_t i) noexcept {
    return {found_.data() + i * stride_, counts_[i]};
  }

  /// Finds the neighbours of all points of a leaf, one run of points that share candidates at a time. `f(first, last,
  /// box)` finds those of a run with bounding box `box` and sets `largest_`.
  template <class F>
  void search_leaf(std::size_t l, F&& f) {
    const std::size_t size = tree_->leaf_size(l);
    if (!(usual_ >= 0)) {
      const found_within first = search_alone(l, 0);
      usual_ = first.count < wanted_ ? 0.0F : first.bound;
    }
    largest_.fill(infinity);
    for (std::size_t first = 0; first != size;) {
      box3 box{query(l, first), query(l, first)};
      std::size_t last = first + 1;
      while (last != size && grow(box, query(l, last))) ++last;
      f(first, last, box);
      first = last;
    }
    // The median is robust against outliers.
    const float median = kernels_.ranked(largest_.data(), size / 2 + 1);
    if (median <= most) usual_ = median;
  }

  void search_run(std::size_t l, std::size_t first, std::size_t last, const box3& box) {
    const float hoped = std::min(usual_ * hoped_, most);
    const float reach = std::min(usual_ * reach_, most);
    const bool shared = share(l, box, reach);
    const bool with_places = !places_.empty();
    if (shared)
      kernels_.near_points_of_each(tree_->leaves.data(), shared_, tree_->leaves[l], first, last, hoped, chosen_.data(),
                                   found_.data(), with_places ? places_.data() : nullptr, stride_, capacity_,
                                   counts_.data());
    for (std::size_t i = first; i != last; ++i) {
      found_within result{shared ? counts_[i] : 0, hoped, with_places};
      if (shared && result.count < wanted_) result = search_near(shared_, l, i, reach);
      if (result.count < wanted_ || result.count > capacity_) result = search_alone(l, i);
      keep(i, result);
    }
  }
  void keep(std::size_t i, const found_within& result) noexcept {
    counts_[i] = static_cast<std::uint32_t>(result.count);
    bounds_[i] = result.bound;
    has_places_[i] = result.has_places;
  }
  /// Gathers the shared candidates of the points within a box, up to squared distance `reach`. If there are too many,
  /// gathers no candidates and returns false.
  bool share(std::size_t l, const box3& box, float reach) {
    const bool shared = gather_shared(l, box, reach);
    shared_reach_ = shared ? reach : -1.0F;
    if (!shared) shared_.count = 0;  // discard a partial result
    return shared;
  }
  [[nodiscard]] found_within search_near(const nearby_leaves& near, std::size_t l, std::size_t i, float bound) {
    const point_row* const leaves = tree_->leaves.data();
    const std::array<float, 3> q = query(l, i);
    float* const found = found_.data() + i * stride_;
    std::uint32_t* const places = places_.empty() ? nullptr : places_.data() + i * stride_;
    return {kernels_.near_point(leaves, near, q, bound, chosen_.data(), found, places, capacity_), bound,
            places != nullptr};
  }

  /// Gathers the leaves near a box within leaf `l` into `shared_`. The box of a row contains those of its leaves, so
  /// rows near a leaf are near the leaf's row; consecutive leaves of a row share these near rows.
  [[nodiscard]] bool gather_shared(std::size_t l, const box3& box, float bound) {
    if (!ensure_near_rows(l / leaf_width, bound)) return gather_near(*tree_, 0, kernels_, box, bound, open_, shared_);
    return gather_rows(box, bound, shared_);
  }
  /// Gathers the leaves near a box within leaf `l` into `own_`.
  [[nodiscard]] bool gather_own(std::size_t l, const box3& box, float bound) {
    if (l / leaf_width == near_rows_of_ && bound <= near_rows_reach_) return gather_rows(box, bound, own_);
    return gather_near(*tree_, 0, kernels_, box, bound, open_, own_);
  }
  /// Gathers the leaves in the near rows that are close to a box.
  [[nodiscard]] bool gather_rows(const box3& box, float bound, nearby_leaves& near) {
    near.count = 0;
    std::array<float, leaf_width> distance;
    for (std::size_t first = 0; first < near_rows_.count; first += leaf_width) {
      std::uint32_t mask = kernels_.near_boxes(near_rows_.row(first), box, bound, distance.data());
      for (; mask != 0; mask &= mask - 1) {
        if (!near.has_room()) return false;
        const std::uint32_t row = near_rows_.leaves[first + static_cast<std::size_t>(std::countr_zero(mask))];
        const box_row& boxes = tree_->levels[0][row];
        kernels_.gather(boxes, kernels_.near_boxes(boxes, box, bound, distance.data()),
                        row * static_cast<std::uint32_t>(leaf_width), near);
      }
    }
    near.finish();
    return true;
  }

  /// Fills `near_rows_` with all rows of leaves within squared distance `bound` of a row. Returns false if there are
  /// too many.
  [[nodiscard]] bool ensure_near_rows(std::size_t row, float bound) {
    if (row == near_rows_of_ && bound <= near_rows_reach_) return true;
    if (tree_->levels.size() == 1 || (row == near_rows_of_ && bound >= too_many_rows_)) return false;
    const box3 box = tree_->levels[1][row / leaf_width].child(row % leaf_width);
    near_rows_of_ = row;
    near_rows_reach_ = std::min(spare * bound, most);
    too_many_rows_ = infinity;
    if (gather_near(*tree_, 1, kernels_, box, near_rows_reach_, open_, near_rows_)) return true;
    near_rows_reach_ = -1.0F;
    too_many_rows_ = bound;
    return false;
  }

  /// Finds the `wanted` nearest points and possibly more; fewer if squared distances overflow.
  [[nodiscard]] found_within search_alone(std::size_t l, std::size_t i) {
    const std::array<float, 3> q = query(l, i);
    float* const found = found_.data() + i * stride_;
    const std::size_t side = wanted_ / leaf_width + 1;
    const std::size_t begin = l - std::min(l, side);
    const std::size_t end = std::min(l + side + 1, tree_->leaves.size());
    found_within result{0, most};
    for (std::size_t n = begin; n != end && result.count <= capacity_; ++n) {
      result.count += kernels_.in_leaf(tree_->leaves[n], q, most, found + result.count);
    }
    if (result.count < wanted_) return search_outwards(q, found);
    std::fill_n(found + result.count, leaf_width, infinity);
    float bound = kernels_.sum_nearest(found, result.count, wanted_, most).largest_squared;
    if (!gather_own(l, {q, q}, bound)) return search_outwards(q, found);
    for (;;) {
      result = search_near(own_, l, i, bound);
      if (result.count <= capacity_) return result;
      // Too many points were found, but they include enough nearer ones.
      bound = kernels_.sum_nearest(found, result.count, wanted_, bound).largest_squared;
      if (bound == result.bound) return search_outwards(q, found);
    }
  }

  /// Finds the `wanted` nearest points by visiting leaves in ascending order of distance.
  [[nodiscard]] found_within search_outwards(const std::array<float, 3>& q, float* found) {
    float bound = most;
    std::size_t count = 0;
    std::size_t enough = wanted_;
    const box3 box{q, q};
    const auto expand = [&](std::uint32_t level, std::uint32_t row) {
      std::array<float, leaf_width> distance;
      std::uint32_t mask = kernels_.near_boxes(tree_->levels[level][row], box, bound, distance.data());
      for (; mask != 0; mask &= mask - 1) {
        const auto i = static_cast<std::uint32_t>(std::countr_zero(mask));
        pending_.push_back({distance[i], level, static_cast<std::uint32_t>(row * leaf_width) + i});
        std::push_heap(pending_.begin(), pending_.end(), later);
      }
    };
    pending_.clear();
    expand(static_cast<std::uint32_t>(tree_->levels.size() - 1), 0);
    while (!pending_.empty()) {
      std::pop_heap(pending_.begin(), pending_.end(), later);
      const pending next = pending_.back();
      pending_.pop_back();
      if (next.distance > bound) break;
      if (next.level != 0) {
        expand(next.level - 1, next.index);
        continue;
      }
      count += kernels_.in_leaf(tree_->leaves[next.index], q, bound, found + count);
      if (count < enough) continue;
      std::nth_element(found, found + (wanted_ - 1), found + count);
      bound = found[wanted_ - 1];
      count = wanted_;
      enough = wanted_ + std::max(wanted_ / 2, leaf_width);
    }
    std::fill_n(found + count, leaf_width, infinity);
    return {count, bound};
  }

  struct pending {
    float distance;
    std::uint32_t level;
    std::uint32_t index;
  };
  static bool later(const pending& a, const pending& b) noexcept { return a.distance > b.distance; }

  const leaf_hierarchy* tree_;
  knn_kernels kernels_;
  std::size_t wanted_;
  std::size_t capacity_;
  std::size_t stride_;
  nearby_leaves shared_;                                                ///< candidates of a run of points
  nearby_leaves own_;                                                   ///< candidates of one point
  nearby_leaves near_rows_;                                             ///< rows of leaves near row near_rows_of_
  std::size_t near_rows_of_ = std::numeric_limits<std::size_t>::max();  ///< row to which near_rows_ belongs, or none
  float near_rows_reach_ = -1;      ///< squared distance up to which near rows are complete; negative if unknown
  float too_many_rows_ = infinity;  ///< smallest squared distance at which near_rows_of_ had too many near rows
  line_vector<std::uint32_t> chosen_;
  line_vector<float> found_;
  line_vector<std::uint32_t> places_;  ///< places of the found points; empty if not requested
  std::vector<pending> pending_;
  std::vector<open_row> open_;
  // State of the points of the visited leaf.
  std::array<std::uint32_t, leaf_width> counts_{};
  std::array<float, leaf_width> bounds_{};
  std::array<bool, leaf_width> has_places_{};
  std::array<float, leaf_width> largest_{};  ///< squared distance to the `wanted`-th nearest
  float hoped_;              ///< multiple of `usual_` that usually suffices; smaller for more neighbours
  float reach_;              ///< multiple of `usual_` that nearly always suffices
  float shared_reach_ = -1;  ///< `shared_` contains all points within this squared distance of the run's box
  float usual_ = -1;         ///< squared distance to the `wanted`-th nearest; negative if not yet known
};
using nearest_search = basic_nearest_search<>;

}  // namespace orbis::cloud::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Exact nearest-neighbour search for single queries in a cloud of our own leaves.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <orbis/cloud/detail/knn/knn_kernels.hpp>
#include <orbis/cloud/detail/knn/leaf_hierarchy.hpp>
#include <orbis/cloud/detail/knn/nearest_search.hpp>
#include <orbis/cloud/detail/knn/visit_near.hpp>
#include <orbis/cloud/neighbors.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud {

/// A search over a copy of the finite points, as float, along a Hilbert curve in leaves of sixteen under a
/// sixteen-wide hierarchy of boxes, each tested by a few vector instructions; see `neighbor_search`. Several
/// times faster to build than a k-d tree, faster in searches within a radius, and indifferent to the order of
/// the points; for a few nearest neighbours of single points a k-d tree is faster. The cloud need not outlive it.
///
/// Building takes O(n log n), a query O(log n + k) on usual clouds. Points at exactly the k-th distance:
/// those with the lowest indices, except where k points and more lie at the query itself. The same results
/// for every policy and processor. Memory: about 20 bytes per point. `const` use is thread-safe and
/// allocates nothing but what the results need.
class leaf_search : public neighbor_queries<leaf_search, float> {
 public:
  /// @pre fewer than 2^32 points
  template <execution_policy Policy, point_range Points>
  leaf_search(const Policy& policy, const Points& points)
      : tree_{detail::make_leaves(policy, points, std::numeric_limits<std::size_t>::max())} {
    assert(tree_.levels.size() <= detail::most_box_levels);
  }
  template <point_range Points>
  explicit leaf_search(const Points& points) : leaf_search(seq, points) {}

  [[nodiscard]] std::size_t size() const noexcept { return tree_.finite; }

  /// Reports to `sink` every point within its bound, near leaves first.
  template <neighbor_sink<float> Sink>
  void visit(const query& q, Sink& sink) const {
    struct {
      const leaf_search& search;
      Sink& sink;
      [[nodiscard]] auto bound_squared() const noexcept { return sink.bound_squared(); }
      bool add(std::uint32_t place, float distance_squared) {
        return sink.add(search.tree_.members[place], distance_squared);
      }
    } by_index{*this, sink};
    detail::visit_near(tree_, kernels_, q, by_index);
  }

 private:
  friend neighbor_queries<leaf_search, float>;
  static constexpr std::size_t few = 12;  ///< neighbours for which a heap is fastest

  /// Keeps the k nearest of those within a bound.
  template <class Neighbor>
  class bounded_sink : public nearest_sink<float, Neighbor> {
   public:
    bounded_sink(std::size_t k, float bound, std::vector<Neighbor>& out)
        : nearest_sink<float, Neighbor>{k, out}, bound_{bound} {}
    [[nodiscard]] float bound_squared() const noexcept {
      return std::min(bound_, nearest_sink<float, Neighbor>::bound_squared());
    }

   private:
    float bound_;
  };

  /// Keeps the k nearest: gathers twice as many before it selects, which is faster than a heap.
  template <class Neighbor>
  class selecting_sink {
   public:
    selecting_sink(std::size_t k, float bound, std::vector<Neighbor>& out) : k_{k}, bound_{bound}, out_{&out} {}
    [[nodiscard]] float bound_squared() const noexcept { return bound_; }
    bool add(std::uint32_t index, float distance_squared) {
      if (distance_squared > bound_) return true;
      out_->push_back({index, distance_squared});
      if (out_->size() >= 2 * k_ + detail::leaf_width) select();
      return bound_ > 0 || out_->size() < k_;  // k identical points: nothing can be nearer
    }
    void finish() {
      select();
      detail::finish_neighbors(*out_);
    }

   private:
    void select() {
      if (out_->size() <= k_) return;
      const auto last = out_->begin() + static_cast<std::ptrdiff_t>(k_ - 1);
      std::nth_element(out_->begin(), last, out_->end(), nearest_sink<float, Neighbor>::less);
      bound_ = detail::measure(*last);
      out_->resize(k_);
    }
    std::size_t k_;
    float bound_;
    std::vector<Neighbor>* out_;
  };

  template <class Neighbor>
  void nearest(const query& q, std::size_t k, std::vector<Neighbor>& out) const {
    out.clear();
    k = std::min(k, size());
    if (k == 0) return;
    const float bound = sufficient_bound(q, k);
    if (k <= few) {
      collect(q, bounded_sink<Neighbor>{k, bound, out});
    } else {
      collect(q, selecting_sink<Neighbor>{k, bound, out});
    }
  }
  /// A squared distance within which there are k points: of those about the leaf nearest to `q`.
  /// @pre 0 < k <= size()
  [[nodiscard]] float sufficient_bound(const query& q, std::size_t k) const {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    constexpr std::size_t most_leaves = 64;
    const std::size_t side = k / detail::leaf_width / 2 + (k > 1 ? 1 : 0);
    if (2 * side + 1 > most_leaves) return infinity;
    std::size_t nearest = 0;
    std::array<float, detail::leaf_width> distance;
    for (std::size_t level = tree_.levels.size(); level-- > 0;) {
      // Boxes overlap: the one whose far corner is nearest most likely holds the neighbours.
      const detail::box_row& boxes = tree_.levels[level][nearest];
      const std::size_t rows = level == 0 ? tree_.leaves.size() : tree_.levels[level - 1].size();
      const std::size_t first = nearest * detail::leaf_width;
      const std::size_t children = std::min(detail::leaf_width, rows - first);
      for (std::size_t i = 0; i != detail::leaf_width; ++i) {
        float sum = 0;
        for (std::size_t a = 0; a != 3; ++a) {
          sum += std::max(std::abs(q[a] - boxes.low[a][i]), std::abs(q[a] - boxes.high[a][i]));
        }
        distance[i] = sum;
      }
      nearest =
          first + static_cast<std::size_t>(
                      std::min_element(distance.begin(), distance.begin() + static_cast<std::ptrdiff_t>(children)) -
                      distance.begin());
    }
    const std::size_t begin = nearest - std::min(nearest, side);
    const std::size_t end = std::min(nearest + side + 1, tree_.leaves.size());
    std::array<float, most_leaves * detail::leaf_width> found;
    std::size_t count = 0;
    for (std::size_t l = begin; l != end; ++l) {
      static_cast<void>(kernels_.distances(tree_.leaves[l], q, infinity, found.data() + count));
      count += tree_.size_of(l);
    }
    if (count < k) return infinity;
    std::nth_element(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(k - 1),
                     found.begin() + static_cast<std::ptrdiff_t>(count));
    return found[k - 1];
  }
  detail::leaf_hierarchy tree_;
  detail::knn_kernels kernels_;
};

}  // namespace orbis::cloud

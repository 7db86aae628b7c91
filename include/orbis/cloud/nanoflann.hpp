// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Nearest-neighbour search with nanoflann's k-d tree on any range of points, without copying the points.
///
/// Works with nanoflann 1.4 and later. Results go to a custom sink and the search parameters are passed as `{}`, so the
/// renaming of `SearchParams` in 1.5 and the changed result set interface in 1.6 have no effect.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <ranges>
#include <vector>

#include <nanoflann.hpp>

#include <orbis/cloud/detail/knn/squared_distance.hpp>
#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/cloud/neighbors.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud {

/// A k-d tree over `points`, which must outlive it and must not change. Skips non-finite points. Construction takes O(n
/// log n), a query O(log n + k) on typical clouds; identical points are supported. Memory: about 20 bytes per point,
/// plus the indices of the finite points if some are not finite.
///
/// The tree reads the points in place, in random order. For a large cloud without spatial order in memory (shuffled, or
/// from a hash table), queries are limited by memory latency.
/// @pre fewer than 2^32 points
template <point_range Points>
class nanoflann_search {
 public:
  using scalar = point_scalar_t<std::ranges::range_value_t<Points>>;
  using query = std::array<scalar, 3>;

  explicit nanoflann_search(const Points& points, std::size_t leaf_size = 12)
      : data_{points}, tree_{3, data_, nanoflann::KDTreeSingleIndexAdaptorParams(leaf_size)} {}
  nanoflann_search(Points&&, std::size_t = 0) = delete;  // a temporary would not outlive the constructor
  nanoflann_search(const nanoflann_search&) = delete;
  nanoflann_search& operator=(const nanoflann_search&) = delete;

  /// Number of points in the tree.
  [[nodiscard]] std::size_t size() const noexcept { return data_.kdtree_get_point_count(); }

  /// Finds the `min(k, size())` points nearest to `q`, nearest first, then by index. A point of the cloud equal to `q`
  /// is found as well. If several points are at exactly the k-th distance, the choice between them is deterministic.
  /// Can be called from several threads concurrently. @pre q is finite
  void knn(const query& q, std::size_t k, std::vector<neighbor<scalar>>& out) const {
    out.clear();
    if (k != 0) find(q, nearest_sink{k, out}, out);
  }
  /// Finds all points at most `r` metres from `q`, nearest first. @pre q is finite, r >= 0
  void radius(const query& q, scalar r, std::vector<neighbor<scalar>>& out) const {
    out.clear();
    find(q, radius_sink{r * r, out}, out);
  }

 private:
  /// Keeps the `k` nearest of the added points, with squared distances, in a max-heap. @pre k > 0
  struct nearest_sink {
    std::size_t k;
    std::vector<neighbor<scalar>>& out;

    /// Squared distance above which points need not be added.
    [[nodiscard]] scalar bound_squared() const noexcept {
      return out.size() < k ? std::numeric_limits<scalar>::infinity() : out.front().distance;
    }
    /// Adds a point if it is among the `k` nearest so far. Returns false to end the search.
    bool add(std::uint32_t index, scalar distance_squared) {
      const neighbor<scalar> found{index, distance_squared};
      if (out.size() == k) {
        if (!is_nearer(found, out.front())) return true;
        std::pop_heap(out.begin(), out.end(), is_nearer<scalar>);
        out.back() = found;
      } else {
        out.push_back(found);
      }
      std::push_heap(out.begin(), out.end(), is_nearer<scalar>);
      // k identical points: no point can be nearer
      return out.size() < k || out.front().distance > 0;
    }
  };
  /// Keeps all points within a radius.
  struct radius_sink {
    scalar bound;  ///< squared
    std::vector<neighbor<scalar>>& out;

    [[nodiscard]] scalar bound_squared() const noexcept { return bound; }
    bool add(std::uint32_t index, scalar distance_squared) {
      if (distance_squared <= bound) out.push_back({index, distance_squared});
      return true;
    }
  };
  /// Collects results in `out` through the sink, and takes the square roots of the distances.
  template <class Sink>
  void find(const query& q, Sink sink, std::vector<neighbor<scalar>>& out) const {
    if (size() == 0) return;
    result_set<Sink> results{&sink, &data_};
    tree_.findNeighbors(results, q.data(), {});
    for (neighbor<scalar>& n : out) n.distance = std::sqrt(n.distance);
    // Sort after taking the roots: different squares can have the same root.
    std::sort(out.begin(), out.end(), is_nearer<scalar>);
  }

  /// nanoflann's view of the points.
  struct dataset {
    explicit dataset(const Points& p) : points{&p} {
      assert(std::ranges::size(p) < std::numeric_limits<std::uint32_t>::max());
      const auto n = static_cast<std::uint32_t>(std::ranges::size(p));
      std::uint32_t first_bad = 0;
      while (first_bad != n && is_finite(at(first_bad))) ++first_bad;
      if (first_bad == n) return;
      some_left_out = true;
      finite.reserve(n);
      for (std::uint32_t i = 0; i != n; ++i) {
        if (i < first_bad || is_finite(at(i))) finite.push_back(i);
      }
    }
    [[nodiscard]] decltype(auto) at(std::uint32_t i) const { return detail::point_at(*points, i); }
    [[nodiscard]] std::uint32_t original(std::uint32_t i) const noexcept { return some_left_out ? finite[i] : i; }
    [[nodiscard]] query position(std::uint32_t i) const { return coordinates<scalar>(at(original(i))); }

    [[nodiscard]] std::size_t kdtree_get_point_count() const noexcept {
      return some_left_out ? finite.size() : std::ranges::size(*points);
    }
    [[nodiscard]] scalar kdtree_get_pt(std::size_t i, std::size_t axis) const {
      return position(static_cast<std::uint32_t>(i))[axis];
    }
    template <class Box>
    [[nodiscard]] bool kdtree_get_bbox(Box&) const noexcept {
      return false;
    }

    const Points* points;
    std::vector<std::uint32_t> finite;  ///< original indices of the points in the tree
    bool some_left_out = false;
  };

  /// The metric, with the summation order of `squared_distance`.
  struct metric {
    using ElementType = scalar;
    using DistanceType = scalar;
    explicit metric(const dataset& d) : data{&d} {}
    [[nodiscard]] scalar evalMetric(const scalar* a, std::uint32_t b, std::size_t /*dimension*/) const {
      return detail::squared_distance<scalar>({a[0], a[1], a[2]}, data->position(b));
    }
    template <class A, class B>
    [[nodiscard]] scalar accum_dist(A a, B b, std::size_t /*axis*/) const {
      return (a - b) * (a - b);
    }
    const dataset* data;
  };

  /// Adapts the sink to nanoflann's interface. nanoflann accumulates the distance to a cell with rounding errors; the
  /// slack in the bound compensates for them, so that no neighbour is lost.
  template <class Sink>
  struct result_set {
    using DistanceType = scalar;  // required by nanoflann 1.6 and later
    using IndexType = std::uint32_t;
    [[nodiscard]] scalar worstDist() const {
      constexpr scalar slack = 64 * std::numeric_limits<scalar>::epsilon();
      return sink->bound_squared() * (1 + slack) + std::numeric_limits<scalar>::min();
    }
    bool addPoint(scalar distance_squared, std::uint32_t i) { return sink->add(data->original(i), distance_squared); }
    [[nodiscard]] bool full() const noexcept { return true; }
    [[nodiscard]] bool empty() const noexcept { return false; }
    [[nodiscard]] std::size_t size() const noexcept { return 0; }
    void sort() noexcept {}
    Sink* sink;
    const dataset* data;
  };

  dataset data_;
  nanoflann::KDTreeSingleIndexAdaptor<metric, dataset, 3, std::uint32_t> tree_;
};

}  // namespace orbis::cloud

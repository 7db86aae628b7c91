// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a nearest-neighbour search is to our algorithms, and the sinks that gather its results.
///
/// Distances are plain metres; wherever a squared one is meant, the name says `_squared`.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace orbis::cloud {

/// A point that was found, by its index in the searched cloud.
template <std::floating_point S>
struct neighbor {
  std::uint32_t index = 0;
  S distance = 0;  ///< metres
  friend bool operator==(const neighbor&, const neighbor&) = default;
};

/// What a search reports to. `bound_squared()`: points further than this need not be reported (it
/// may shrink while the search goes on). `add(index, distance_squared)`: one found point; returns
/// false to end the search.
template <class T, class S>
concept neighbor_sink = requires(T& sink, const T& constant, std::uint32_t index, S distance_squared) {
  { constant.bound_squared() } -> std::convertible_to<S>;
  { sink.add(index, distance_squared) } -> std::convertible_to<bool>;
};

/// Exact nearest-neighbour search in a fixed cloud; `const` use is thread-safe.
///
/// - `size()`: how many points are searched (non-finite ones are not).
/// - `knn(query, k, out)`: the `min(k, size())` nearest points.
/// - `radius(query, r, out)`: all points within `r` metres, the border included.
///
/// Both replace the contents of `out`, nearest first, equal distances by index. Which of several
/// points at exactly the k-th distance is reported is deterministic but up to the backend. Queries
/// are finite; the query itself, if it is a point of the cloud, is found as well.
template <class T>
concept neighbor_search = requires(const T& search, const std::array<typename T::scalar, 3>& query, std::size_t k,
                                   typename T::scalar r, std::vector<neighbor<typename T::scalar>>& out) {
  requires std::floating_point<typename T::scalar>;
  { search.size() } -> std::convertible_to<std::size_t>;
  search.knn(query, k, out);
  search.radius(query, r, out);
};

/// Keeps the `k` nearest of what it is given, in a max-heap. @pre k > 0
template <std::floating_point S>
class nearest_sink {
 public:
  /// Gathers into `out`, whose `distance` holds squares until `finish`.
  nearest_sink(std::size_t k, std::vector<neighbor<S>>& out) : k_{k}, out_{&out} {
    assert(k > 0);
    out.clear();
  }
  [[nodiscard]] S bound_squared() const noexcept {
    return out_->size() < k_ ? std::numeric_limits<S>::infinity() : out_->front().distance;
  }
  bool add(std::uint32_t index, S distance_squared) {
    const neighbor<S> found{index, distance_squared};
    if (out_->size() == k_) {
      if (!less(found, out_->front())) return true;
      std::pop_heap(out_->begin(), out_->end(), less);
      out_->back() = found;
    } else {
      out_->push_back(found);
    }
    std::push_heap(out_->begin(), out_->end(), less);
    // k identical points: nothing can be nearer.
    return out_->size() < k_ || out_->front().distance > 0;
  }
  /// Takes the roots, and sorts (after the roots: different squares can have the same one).
  void finish() {
    for (neighbor<S>& n : *out_) n.distance = std::sqrt(n.distance);
    std::sort(out_->begin(), out_->end(), less);
  }

  [[nodiscard]] static bool less(const neighbor<S>& a, const neighbor<S>& b) noexcept {
    return a.distance < b.distance || (a.distance == b.distance && a.index < b.index);
  }

 private:
  std::size_t k_;
  std::vector<neighbor<S>>* out_;
};

/// Keeps everything within a radius.
template <std::floating_point S>
class radius_sink {
 public:
  radius_sink(S radius, std::vector<neighbor<S>>& out) : bound_{radius * radius}, out_{&out} { out.clear(); }
  [[nodiscard]] S bound_squared() const noexcept { return bound_; }
  bool add(std::uint32_t index, S distance_squared) {
    if (distance_squared <= bound_) out_->push_back({index, distance_squared});
    return true;
  }
  void finish() {
    for (neighbor<S>& n : *out_) n.distance = std::sqrt(n.distance);
    std::sort(out_->begin(), out_->end(), nearest_sink<S>::less);
  }

 private:
  S bound_;
  std::vector<neighbor<S>>* out_;
};

}  // namespace orbis::cloud

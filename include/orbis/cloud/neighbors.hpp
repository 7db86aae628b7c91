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

/// A point that was found, with the square of its distance, which is what searches compute.
template <std::floating_point S>
struct squared_neighbor {
  std::uint32_t index = 0;
  S distance_squared = 0;  ///< metres squared
  friend bool operator==(const squared_neighbor&, const squared_neighbor&) = default;
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
/// - `knn_squared(query, k, out)`, `radius_squared(query, r_squared, out)`: the same without taking roots;
///   the radius that is passed, like the distances that come back, is a square.
///
/// All replace the contents of `out`, nearest first, equal distances by index. Which of several
/// points at exactly the k-th distance is reported is deterministic but up to the backend. Queries
/// are finite; the query itself, if it is a point of the cloud, is found as well.
template <class T>
concept neighbor_search = requires(const T& search, const std::array<typename T::scalar, 3>& query, std::size_t k,
                                   typename T::scalar r, std::vector<neighbor<typename T::scalar>>& out,
                                   std::vector<squared_neighbor<typename T::scalar>>& squared_out) {
  requires std::floating_point<typename T::scalar>;
  { search.size() } -> std::convertible_to<std::size_t>;
  search.knn(query, k, out);
  search.radius(query, r, out);
  search.knn_squared(query, k, squared_out);
  search.radius_squared(query, r, squared_out);
};

namespace detail {

/// What a neighbour is ordered by: its distance or the square.
template <std::floating_point S>
[[nodiscard]] constexpr S measure(const neighbor<S>& n) noexcept {
  return n.distance;
}
template <std::floating_point S>
[[nodiscard]] constexpr S measure(const squared_neighbor<S>& n) noexcept {
  return n.distance_squared;
}

/// From what was gathered, squares in no order, to what is handed out.
template <class Neighbor>
void finish_neighbors(std::vector<Neighbor>& found) {
  if constexpr (requires { found.front().distance; }) {
    for (Neighbor& n : found) n.distance = std::sqrt(n.distance);
  }
  // After the roots: different squares can have the same one.
  std::sort(found.begin(), found.end(), [](const Neighbor& a, const Neighbor& b) {
    return measure(a) < measure(b) || (measure(a) == measure(b) && a.index < b.index);
  });
}

}  // namespace detail

/// Keeps the `k` nearest of what it is given, in a max-heap, as plain or as squared neighbours. @pre k > 0
template <std::floating_point S, class Neighbor = neighbor<S>>
class nearest_sink {
 public:
  /// Gathers into `out`, which holds squares until `finish`.
  nearest_sink(std::size_t k, std::vector<Neighbor>& out) : k_{k}, out_{&out} {
    assert(k > 0);
    out.clear();
  }
  [[nodiscard]] S bound_squared() const noexcept {
    return out_->size() < k_ ? std::numeric_limits<S>::infinity() : detail::measure(out_->front());
  }
  bool add(std::uint32_t index, S distance_squared) {
    const Neighbor found{index, distance_squared};
    if (out_->size() == k_) {
      if (!less(found, out_->front())) return true;
      std::pop_heap(out_->begin(), out_->end(), less);
      out_->back() = found;
    } else {
      out_->push_back(found);
    }
    std::push_heap(out_->begin(), out_->end(), less);
    // k identical points: nothing can be nearer.
    return out_->size() < k_ || detail::measure(out_->front()) > 0;
  }
  /// Takes the roots, if plain distances are wanted, and sorts.
  void finish() { detail::finish_neighbors(*out_); }

  [[nodiscard]] static bool less(const Neighbor& a, const Neighbor& b) noexcept {
    return detail::measure(a) < detail::measure(b) || (detail::measure(a) == detail::measure(b) && a.index < b.index);
  }

 private:
  std::size_t k_;
  std::vector<Neighbor>* out_;
};
template <std::floating_point S>
nearest_sink(std::size_t, std::vector<neighbor<S>>&) -> nearest_sink<S>;
template <std::floating_point S>
nearest_sink(std::size_t, std::vector<squared_neighbor<S>>&) -> nearest_sink<S, squared_neighbor<S>>;

/// Keeps everything within a radius, as plain or as squared neighbours.
template <std::floating_point S, class Neighbor = neighbor<S>>
class radius_sink {
 public:
  radius_sink(S radius, std::vector<Neighbor>& out) : bound_{radius * radius}, out_{&out} { out.clear(); }
  /// Keeps everything within a radius that is given by its square, in square metres.
  [[nodiscard]] static radius_sink within_squared(S radius_squared, std::vector<Neighbor>& out) {
    radius_sink sink{0, out};
    sink.bound_ = radius_squared;
    return sink;
  }
  [[nodiscard]] S bound_squared() const noexcept { return bound_; }
  bool add(std::uint32_t index, S distance_squared) {
    if (distance_squared <= bound_) out_->push_back({index, distance_squared});
    return true;
  }
  void finish() { detail::finish_neighbors(*out_); }

 private:
  S bound_;
  std::vector<Neighbor>* out_;
};

/// The four queries of `neighbor_search`, for a search that derives from this and has `size()` and
/// `visit(query, sink)`, which reports to the sink every point within its bound. All are `const` and thread-safe.
template <class Search, std::floating_point S>
class neighbor_queries {
 public:
  using scalar = S;
  using query = std::array<S, 3>;

  /// The `min(k, size())` points nearest to `q`, nearest first. @pre q is finite
  void knn(const query& q, std::size_t k, std::vector<neighbor<S>>& out) const { self().nearest(q, k, out); }
  /// The points that `knn` finds, with squared distances.
  void knn_squared(const query& q, std::size_t k, std::vector<squared_neighbor<S>>& out) const {
    self().nearest(q, k, out);
  }
  /// All points within `r` metres of `q`, nearest first. @pre q is finite, r >= 0
  void radius(const query& q, S r, std::vector<neighbor<S>>& out) const { collect(q, radius_sink<S>{r, out}); }
  /// All points at a squared distance of at most `r_squared`, with squared distances, nearest first.
  /// @pre q is finite, r_squared >= 0
  void radius_squared(const query& q, S r_squared, std::vector<squared_neighbor<S>>& out) const {
    collect(q, radius_sink<S, squared_neighbor<S>>::within_squared(r_squared, out));
  }

 protected:
  template <class Sink>
  void collect(const query& q, Sink sink) const {
    self().visit(q, sink);
    sink.finish();
  }
  /// By a heap; a search may have a faster one of its own.
  template <class Neighbor>
  void nearest(const query& q, std::size_t k, std::vector<Neighbor>& out) const {
    out.clear();
    if (k != 0) collect(q, nearest_sink<S, Neighbor>{k, out});
  }

 private:
  [[nodiscard]] const Search& self() const noexcept { return static_cast<const Search&>(*this); }
};

}  // namespace orbis::cloud

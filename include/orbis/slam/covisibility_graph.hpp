// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Which keyframes see the same landmarks, and how many.
///
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM: a versatile and accurate monocular SLAM system",
/// T-RO 31 (2015), section III.D; the idea is H. Strasdat's, "Double window optimisation for constant time visual
/// SLAM", ICCV 2011.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <orbis/slam/ids.hpp>

namespace orbis::slam {

/// Another keyframe, and how many landmarks both see.
struct covisible {
  keyframe_id keyframe = no_id;
  std::uint32_t shared = 0;
  friend bool operator==(const covisible&, const covisible&) = default;
};

/// The order in which keyframes are named everywhere: more shared landmarks first, the older one where equal.
[[nodiscard]] constexpr bool stronger(const covisible& a, const covisible& b) noexcept {
  return a.shared != b.shared ? a.shared > b.shared : a.keyframe < b.keyframe;
}

namespace detail {
/// Where the pair with `k` is, or should be, in pairs by ascending keyframe.
template <class Pairs>
[[nodiscard]] auto find_pair(Pairs&& pairs, keyframe_id k) {
  return std::lower_bound(pairs.begin(), pairs.end(), k,
                          [](const covisible& pair, keyframe_id id) { return pair.keyframe < id; });
}
}  // namespace detail

/// A symmetric graph with weights. Counts every pair of keyframes that shares a landmark; an edge is a pair that
/// shares at least `min_shared`, and for a keyframe that has no such edge the one pair in which it shares most. What
/// it says depends on the landmarks alone, not on the order in which they came to be shared.
///
/// Let d be the number of keyframes that one shares landmarks with: lookups and changes take O(log d), but for a new
/// pair, the end of one, and a loss in the strongest, which take O(d). Memory is O(1) for a keyframe, erased or not,
/// and O(1) for a pair.
class covisibility_graph {
 public:
  explicit covisibility_graph(std::uint32_t min_shared = 15) : min_shared_{min_shared} {}

  [[nodiscard]] std::uint32_t min_shared() const noexcept { return min_shared_; }

  /// Two keyframes see `count` more of the same landmarks. @pre a != b
  void share(keyframe_id a, keyframe_id b, std::uint32_t count = 1) {
    assert(a != b);
    if (count == 0) return;
    if (const std::size_t needed = std::size_t{std::max(a, b)} + 1; needed > nodes_.size()) nodes_.resize(needed);
    increase(nodes_[a], b, count);
    increase(nodes_[b], a, count);
  }
  /// ... and so many fewer. @pre they share as many
  void unshare(keyframe_id a, keyframe_id b, std::uint32_t count = 1) {
    assert(shared(a, b) >= count);
    if (count == 0) return;
    decrease(nodes_[a], b, count);
    decrease(nodes_[b], a, count);
  }
  /// A keyframe shares nothing any more. O(d^2) at most.
  void erase(keyframe_id k) {
    if (k >= nodes_.size()) return;
    for (const covisible& other : std::exchange(nodes_[k], {}).pairs) decrease(nodes_[other.keyframe], k, other.shared);
  }
  /// Takes over another graph, whose keyframes' numbers grow by `shift`. @pre there are none from `shift` on
  void append(covisibility_graph&& other, keyframe_id shift) {
    assert(nodes_.size() <= shift);
    nodes_.resize(shift);
    for (node& n : other.nodes_) {
      for (covisible& pair : n.pairs) pair.keyframe += shift;
      if (n.strongest.keyframe != no_id) n.strongest.keyframe += shift;
      nodes_.push_back(std::move(n));
    }
    other.nodes_.clear();
  }

  /// How many landmarks both see.
  [[nodiscard]] std::uint32_t shared(keyframe_id a, keyframe_id b) const {
    const std::span<const covisible> pairs = sharing(a);
    const auto at = detail::find_pair(pairs, b);
    return at != pairs.end() && at->keyframe == b ? at->shared : 0;
  }
  /// Whether there is an edge.
  [[nodiscard]] bool connected(keyframe_id a, keyframe_id b) const {
    const std::uint32_t both = shared(a, b);
    return both != 0 && (both >= min_shared_ || is_only_edge(a, b) || is_only_edge(b, a));
  }
  /// All that a keyframe shares a landmark with, edges or not, by ascending number.
  [[nodiscard]] std::span<const covisible> sharing(keyframe_id k) const {
    return k < nodes_.size() ? std::span<const covisible>{nodes_[k].pairs} : std::span<const covisible>{};
  }
  /// The one that it shares most with; `no_id` if it shares nothing.
  [[nodiscard]] covisible strongest(keyframe_id k) const {
    return k < nodes_.size() ? nodes_[k].strongest : covisible{};
  }

  /// The keyframes at the other ends of its edges, the strongest first; at most `limit`. O(d log d).
  [[nodiscard]] std::vector<covisible> neighbors(keyframe_id k,
                                                 std::size_t limit = std::numeric_limits<std::size_t>::max()) const {
    std::vector<covisible> found;
    for (const covisible& pair : sharing(k))
      if (pair.shared >= min_shared_ || is_only_edge(k, pair.keyframe) || is_only_edge(pair.keyframe, k))
        found.push_back(pair);
    const auto end = found.begin() + static_cast<std::ptrdiff_t>(std::min(limit, found.size()));
    std::partial_sort(found.begin(), end, found.end(), stronger);
    found.erase(end, found.end());
    return found;
  }
  /// Those that it shares at least so many with, the strongest first. O(d log d).
  [[nodiscard]] std::vector<covisible> at_least(keyframe_id k, std::uint32_t shared) const {
    std::vector<covisible> found;
    for (const covisible& pair : sharing(k))
      if (pair.shared >= shared) found.push_back(pair);
    std::sort(found.begin(), found.end(), stronger);
    return found;
  }

 private:
  struct node {
    std::vector<covisible> pairs;  ///< by ascending keyframe
    covisible strongest;
  };

  /// Whether `a` has no other edge than that with `b`, for want of a strong one.
  [[nodiscard]] bool is_only_edge(keyframe_id a, keyframe_id b) const {
    return nodes_[a].strongest.keyframe == b && nodes_[a].strongest.shared < min_shared_;
  }
  static void increase(node& n, keyframe_id k, std::uint32_t count) {
    auto at = detail::find_pair(n.pairs, k);
    if (at == n.pairs.end() || at->keyframe != k) at = n.pairs.insert(at, {k, 0});
    at->shared += count;
    if (stronger(*at, n.strongest)) n.strongest = *at;
  }
  static void decrease(node& n, keyframe_id k, std::uint32_t count) {
    const auto at = detail::find_pair(n.pairs, k);
    at->shared -= count;
    if (at->shared == 0) n.pairs.erase(at);
    if (n.strongest.keyframe != k) return;
    n.strongest = {};
    for (const covisible& pair : n.pairs)
      if (stronger(pair, n.strongest)) n.strongest = pair;
  }

  std::uint32_t min_shared_;
  std::vector<node> nodes_;  ///< by keyframe
};

}  // namespace orbis::slam

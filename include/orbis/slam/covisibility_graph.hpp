// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The covisibility graph: the keyframes that observe the same landmarks, and the number of shared landmarks.
///
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM: a versatile and accurate monocular SLAM system",
/// T-RO 31 (2015), section III.D; the idea is from H. Strasdat et al., "Double window optimisation for constant time
/// visual SLAM", ICCV 2011.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include <orbis/slam/ids.hpp>

namespace orbis::slam {

/// A keyframe and the number of landmarks it shares with the queried one.
struct covisible {
  keyframe_id keyframe;
  std::uint32_t shared = 0;
  friend bool operator==(const covisible&, const covisible&) = default;
};

/// Order of covisible keyframes: more shared landmarks first; if equal, the older keyframe first.
[[nodiscard]] constexpr bool stronger(const covisible& a, const covisible& b) noexcept {
  return a.shared != b.shared ? a.shared > b.shared : a.keyframe < b.keyframe;
}

namespace detail {
/// Returns the position of the pair with `k`, or its insertion position, in pairs sorted by keyframe.
template <class Pairs>
[[nodiscard]] auto find_pair(Pairs&& pairs, keyframe_id k) {
  return std::lower_bound(pairs.begin(), pairs.end(), k,
                          [](const covisible& pair, keyframe_id id) { return pair.keyframe < id; });
}
}  // namespace detail

/// A symmetric graph that stores the number of shared landmarks for every pair of keyframes that share at least one. A
/// pair has an edge if it shares at least `min_shared` landmarks; a keyframe without such a pair has one edge, to the
/// keyframe with which it shares the most. The graph depends only on these numbers, not on the order of the changes.
///
/// Let d be the number of keyframes that share landmarks with a given one. Lookups and changes take O(log d); adding a
/// pair, removing a pair and lowering the count of the strongest pair take O(d). Memory: O(1) per keyframe that shares
/// landmarks, and per pair.
class covisibility_graph {
 public:
  explicit covisibility_graph(std::uint32_t min_shared = 15) : min_shared_{min_shared} {}

  [[nodiscard]] std::uint32_t min_shared() const noexcept { return min_shared_; }
  /// The number of keyframes that share a landmark with another one.
  [[nodiscard]] std::size_t size() const noexcept { return nodes_.size(); }

  /// Adds `count` to the number of landmarks that two keyframes share. @pre a != b
  void share(keyframe_id a, keyframe_id b, std::uint32_t count = 1) {
    assert(a != b);
    if (count == 0) return;
    increase(nodes_[a.value()], b, count);
    increase(nodes_[b.value()], a, count);
  }
  /// Subtracts `count` from the number of landmarks that two keyframes share. @pre shared(a, b) >= count
  void unshare(keyframe_id a, keyframe_id b, std::uint32_t count = 1) {
    assert(shared(a, b) >= count);
    if (count == 0) return;
    decrease(a, b, count);
    decrease(b, a, count);
  }
  /// Removes all pairs of a keyframe. O(d^2) at most.
  void erase(keyframe_id k) {
    const auto gone = nodes_.extract(k.value());
    if (gone.empty()) return;
    for (const covisible& other : gone.mapped().pairs) decrease(other.keyframe, k, other.shared);
  }
  /// Merges another graph into this one, with its ids increased by `offset`. @pre all ids of this graph are less than
  /// `offset`
  void append(covisibility_graph&& other, std::uint32_t offset) {
    for (auto& [id, n] : other.nodes_) {
      assert(!nodes_.contains(id + offset));
      for (covisible& pair : n.pairs) pair.keyframe += offset;
      n.strongest.keyframe += offset;
      nodes_[id + offset] = std::move(n);
    }
    other.nodes_ = {};
  }

  /// Returns the number of landmarks that both keyframes observe.
  [[nodiscard]] std::uint32_t shared(keyframe_id a, keyframe_id b) const {
    const std::span<const covisible> pairs = sharing(a);
    const auto at = detail::find_pair(pairs, b);
    return at != pairs.end() && at->keyframe == b ? at->shared : 0;
  }
  /// Returns true if two keyframes are connected by an edge.
  [[nodiscard]] bool connected(keyframe_id a, keyframe_id b) const {
    const std::uint32_t both = shared(a, b);
    return both != 0 && (both >= min_shared_ || is_only_edge(a, b) || is_only_edge(b, a));
  }
  /// All keyframes that share a landmark with `k`, with or without an edge, in ascending order of id.
  [[nodiscard]] std::span<const covisible> sharing(keyframe_id k) const {
    const auto n = nodes_.find(k.value());
    return n != nodes_.end() ? std::span<const covisible>{n->second.pairs} : std::span<const covisible>{};
  }
  /// Returns the keyframe with which `k` shares the most landmarks; `no_id` if it shares none.
  [[nodiscard]] covisible strongest(keyframe_id k) const {
    const auto n = nodes_.find(k.value());
    return n != nodes_.end() ? n->second.strongest : covisible{};
  }

  /// Returns the neighbours of `k` in the graph, the strongest first; at most `limit`. O(d log d).
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
  /// Returns the keyframes that share at least `shared` landmarks with `k`, the strongest first. O(d log d).
  [[nodiscard]] std::vector<covisible> at_least(keyframe_id k, std::uint32_t shared) const {
    std::vector<covisible> found;
    for (const covisible& pair : sharing(k))
      if (pair.shared >= shared) found.push_back(pair);
    std::sort(found.begin(), found.end(), stronger);
    return found;
  }

 private:
  struct node {                    // a keyframe that shares landmarks
    std::vector<covisible> pairs;  ///< in ascending order of keyframe
    covisible strongest;
  };

  /// Returns true if no pair of `a` reaches `min_shared`, so that the edge to `b` is its only edge.
  [[nodiscard]] bool is_only_edge(keyframe_id a, keyframe_id b) const {
    const covisible most = strongest(a);
    return most.keyframe == b && most.shared < min_shared_;
  }
  static void increase(node& n, keyframe_id k, std::uint32_t count) {
    auto at = detail::find_pair(n.pairs, k);
    if (at == n.pairs.end() || at->keyframe != k) at = n.pairs.insert(at, {k, 0});
    at->shared += count;
    if (stronger(*at, n.strongest)) n.strongest = *at;
  }
  void decrease(keyframe_id of, keyframe_id k, std::uint32_t count) {
    node& n = nodes_.find(of.value())->second;
    const auto at = detail::find_pair(n.pairs, k);
    at->shared -= count;
    if (at->shared == 0) n.pairs.erase(at);
    if (n.pairs.empty()) return static_cast<void>(nodes_.erase(of.value()));
    if (n.strongest.keyframe != k) return;
    n.strongest = {};
    for (const covisible& pair : n.pairs)
      if (stronger(pair, n.strongest)) n.strongest = pair;
  }

  std::uint32_t min_shared_;
  std::unordered_map<std::uint32_t, node> nodes_;  ///< keyed by keyframe id
};

}  // namespace orbis::slam

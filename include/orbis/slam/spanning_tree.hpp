// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The spanning tree of the keyframes of a map, and the loops closed between them.
///
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM: a versatile and accurate monocular SLAM system",
/// T-RO 31 (2015), section III.D.
#pragma once

#include <algorithm>
#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

#include <orbis/slam/ids.hpp>

namespace orbis::slam {

/// A tree: each keyframe except the root has a parent. In addition, undirected loop edges can connect any two
/// keyframes. Children and loop edges are sorted by id. The caller chooses the parents.
class spanning_tree {
 public:
  [[nodiscard]] std::size_t size() const noexcept { return nodes_.size(); }
  [[nodiscard]] bool contains(keyframe_id k) const noexcept { return nodes_.contains(k.value()); }
  /// The root; `no_id` if there is no keyframe.
  [[nodiscard]] keyframe_id root() const noexcept { return root_; }
  /// The parent of a keyframe; `no_id` for the root. @pre contains(k)
  [[nodiscard]] keyframe_id parent(keyframe_id k) const { return at(k).parent; }
  /// The children of a keyframe in ascending order of id. @pre contains(k)
  [[nodiscard]] const std::vector<keyframe_id>& children(keyframe_id k) const { return at(k).children; }
  /// The other ends of the loop edges of a keyframe, in ascending order of id. @pre contains(k)
  [[nodiscard]] const std::vector<keyframe_id>& loop_edges(keyframe_id k) const { return at(k).loops; }

  /// Adds a keyframe. @pre !contains(k); contains(parent), or `parent` is `no_id` and the tree is empty
  void add(keyframe_id k, keyframe_id parent) {
    assert(!contains(k) && (parent == no_id ? size() == 0 : contains(parent)));
    nodes_.try_emplace(k.value());
    if (parent == no_id) {
      root_ = k;
    } else {
      attach(k, parent);
    }
  }

  /// Makes `k` the root: the edges between it and the old root change direction. O(depth). @pre contains(k)
  void set_root(keyframe_id k) {
    keyframe_id above = no_id;
    for (root_ = k; k != no_id;) {
      const keyframe_id next = at(k).parent;
      if (next != no_id) remove(nodes_[next.value()].children, k);
      nodes_[k.value()].parent = no_id;
      if (above != no_id) attach(k, above);
      above = std::exchange(k, next);
    }
  }

  /// Records a loop closure between two keyframes. @pre a != b, and both exist
  void add_loop_edge(keyframe_id a, keyframe_id b) {
    assert(a != b && contains(a) && contains(b));
    insert(nodes_[a.value()].loops, b);
    insert(nodes_[b.value()].loops, a);
  }

  /// Erases a keyframe. Each of its children gets a new parent: the old parent or another child, whichever shares the
  /// most landmarks with it (`shared(a, b)`); the old parent if none does. If the root is erased, its oldest child
  /// becomes the root. The loop edges of `k` are moved to the returned keyframe: the parent, or the new root, or
  /// `no_id` if none is left. O(children^2). @pre contains(k)
  template <std::invocable<keyframe_id, keyframe_id> Shared>
  keyframe_id erase(keyframe_id k, Shared&& shared) {
    const node gone = std::move(nodes_.extract(k.value()).mapped());
    std::vector<keyframe_id> orphans = gone.children;
    keyframe_id replacement = gone.parent;
    if (replacement != no_id) {
      remove(nodes_[replacement.value()].children, k);
    } else {
      root_ = replacement = orphans.empty() ? no_id : orphans.front();
      if (replacement != no_id) {
        nodes_[replacement.value()].parent = no_id;
        orphans.erase(orphans.begin());
      }
    }
    adopt(std::move(orphans), replacement, shared);
    for (const keyframe_id other : gone.loops) {
      remove(nodes_[other.value()].loops, k);
      if (replacement != no_id && other != replacement) add_loop_edge(replacement, other);
    }
    return replacement;
  }

  /// Adds another tree after adding `offset` to its ids. Keyframe `by` of the other tree becomes the root of that tree
  /// and a child of `at`.
  /// @pre all ids of this tree are less than `offset`; `at` and `by` exist, unless either tree is empty
  void append(spanning_tree&& other, std::uint32_t offset, keyframe_id at, keyframe_id by) {
    const bool was_empty = size() == 0;
    if (other.size() != 0 && !was_empty) other.set_root(by);
    for (auto& [id, n] : other.nodes_) {
      assert(!contains(id + offset));
      if (n.parent != no_id) n.parent += offset;
      for (keyframe_id& c : n.children) c += offset;
      for (keyframe_id& l : n.loops) l += offset;
      nodes_[id + offset] = std::move(n);
    }
    if (other.size() != 0) {
      if (was_empty) {
        root_ = other.root_ + offset;
      } else {
        attach(by + offset, at);
      }
    }
    other = {};
  }

 private:
  struct node {
    keyframe_id parent;
    std::vector<keyframe_id> children, loops;
  };

  [[nodiscard]] const node& at(keyframe_id k) const {
    assert(contains(k));
    return nodes_.find(k.value())->second;
  }
  static void insert(std::vector<keyframe_id>& sorted, keyframe_id k) {
    const auto place = std::lower_bound(sorted.begin(), sorted.end(), k);
    if (place == sorted.end() || *place != k) sorted.insert(place, k);
  }
  static void remove(std::vector<keyframe_id>& sorted, keyframe_id k) {
    sorted.erase(std::lower_bound(sorted.begin(), sorted.end(), k));
  }
  void attach(keyframe_id k, keyframe_id parent) {
    nodes_[k.value()].parent = parent;
    insert(nodes_[parent.value()].children, k);
  }

  /// Prim's algorithm: the next orphan is the one that shares the most landmarks with a keyframe in the tree.
  template <class Shared>
  void adopt(std::vector<keyframe_id> orphans, keyframe_id replacement, Shared&& shared) {
    struct edge {
      std::uint32_t shared;
      keyframe_id to;
    };
    std::vector<edge> best;
    for (const keyframe_id k : orphans)
      best.push_back({static_cast<std::uint32_t>(shared(k, replacement)), replacement});
    while (!orphans.empty()) {
      std::size_t next = 0;
      for (std::size_t i = 1; i != orphans.size(); ++i)
        if (best[i].shared > best[next].shared) next = i;
      const keyframe_id placed = orphans[next];
      attach(placed, best[next].to);
      orphans.erase(orphans.begin() + static_cast<std::ptrdiff_t>(next));
      best.erase(best.begin() + static_cast<std::ptrdiff_t>(next));
      for (std::size_t i = 0; i != orphans.size(); ++i)
        if (const auto both = static_cast<std::uint32_t>(shared(orphans[i], placed)); both > best[i].shared)
          best[i] = {both, placed};
    }
  }

  std::unordered_map<std::uint32_t, node> nodes_;  ///< keyed by keyframe id
  keyframe_id root_;
};

}  // namespace orbis::slam

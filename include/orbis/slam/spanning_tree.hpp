// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The tree that holds the keyframes of a map together, and the loops closed between them.
///
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM: a versatile and accurate monocular SLAM system",
/// T-RO 31 (2015), section III.D.
#pragma once

#include <algorithm>
#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/slam/ids.hpp>

namespace orbis::slam {

/// Keyframes, each but the root with a parent, and undirected loop edges between any two of them. Children and loop
/// edges are listed by ascending number. Nothing here knows why a keyframe has the parent it has.
class spanning_tree {
 public:
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] bool contains(keyframe_id k) const noexcept { return k < nodes_.size() && nodes_[k].present; }
  /// `no_id` while there is no keyframe.
  [[nodiscard]] keyframe_id root() const noexcept { return root_; }
  /// `no_id` for the root. @pre contains(k)
  [[nodiscard]] keyframe_id parent(keyframe_id k) const { return at(k).parent; }
  [[nodiscard]] const std::vector<keyframe_id>& children(keyframe_id k) const { return at(k).children; }
  [[nodiscard]] const std::vector<keyframe_id>& loop_edges(keyframe_id k) const { return at(k).loops; }
  /// Whether `k` is `ancestor` or below it. O(depth).
  [[nodiscard]] bool descends_from(keyframe_id k, keyframe_id ancestor) const {
    while (k != no_id && k != ancestor) k = at(k).parent;
    return k == ancestor;
  }

  /// @pre !contains(k); `parent` is there, or is `no_id` and nothing is
  void add(keyframe_id k, keyframe_id parent) {
    assert(!contains(k) && (parent == no_id ? size_ == 0 : contains(parent)));
    if (k >= nodes_.size()) nodes_.resize(std::size_t{k} + 1);
    nodes_[k].present = true;
    ++size_;
    if (parent == no_id) {
      root_ = k;
    } else {
      hang(k, parent);
    }
  }

  /// @pre both are there, and `parent` does not descend from `k`
  void set_parent(keyframe_id k, keyframe_id parent) {
    assert(contains(parent) && !descends_from(parent, k));
    if (nodes_[k].parent == parent) return;
    remove(nodes_[nodes_[k].parent].children, k);
    hang(k, parent);
  }

  /// Turns the edges around that lie between the root and `k`. O(depth).
  void set_root(keyframe_id k) {
    keyframe_id above = no_id;
    for (root_ = k; k != no_id;) {
      const keyframe_id next = at(k).parent;
      if (next != no_id) remove(nodes_[next].children, k);
      nodes_[k].parent = no_id;
      if (above != no_id) hang(k, above);
      above = std::exchange(k, next);
    }
  }

  /// Notes that a loop was closed between two keyframes. @pre a != b, and both are there
  void add_loop_edge(keyframe_id a, keyframe_id b) {
    assert(a != b && contains(a) && contains(b));
    insert(nodes_[a].loops, b);
    insert(nodes_[b].loops, a);
  }

  /// Takes a keyframe out. Its children go where they share most landmarks (`shared(a, b)`): to its parent, or to one
  /// another; those that share nothing go to the parent. The root's place is taken by its oldest child. Loop edges
  /// pass to the keyframe that is returned: the parent, or the new root, or `no_id` if none is left. O(children^2).
  template <std::invocable<keyframe_id, keyframe_id> Shared>
  keyframe_id erase(keyframe_id k, Shared&& shared) {
    const node gone = std::exchange(nodes_[k], {});
    --size_;
    std::vector<keyframe_id> orphans = gone.children;
    keyframe_id heir = gone.parent;
    if (heir != no_id) {
      remove(nodes_[heir].children, k);
    } else {
      root_ = heir = orphans.empty() ? no_id : orphans.front();
      if (heir != no_id) {
        nodes_[heir].parent = no_id;
        orphans.erase(orphans.begin());
      }
    }
    adopt(std::move(orphans), heir, shared);
    for (const keyframe_id other : gone.loops) {
      remove(nodes_[other].loops, k);
      if (heir != no_id && other != heir) add_loop_edge(heir, other);
    }
    return heir;
  }

  /// Takes over another tree, whose numbers grow by `shift`, and hangs it under `at` by its keyframe `by`, which
  /// becomes its root before. @pre there are no numbers from `shift` on; `at` and `by` are there, unless either tree is
  /// empty
  void append(spanning_tree&& other, keyframe_id shift, keyframe_id at, keyframe_id by) {
    assert(nodes_.size() <= shift);
    if (other.size_ != 0 && size_ != 0) other.set_root(by);
    nodes_.resize(shift);
    for (node& n : other.nodes_) {
      if (n.parent != no_id) n.parent += shift;
      for (keyframe_id& c : n.children) c += shift;
      for (keyframe_id& l : n.loops) l += shift;
      nodes_.push_back(std::move(n));
    }
    if (other.size_ != 0) {
      if (size_ == 0) {
        root_ = other.root_ + shift;
      } else {
        hang(by + shift, at);
      }
    }
    size_ += other.size_;
    other = {};
  }

 private:
  struct node {
    keyframe_id parent = no_id;
    bool present = false;
    std::vector<keyframe_id> children, loops;
  };

  [[nodiscard]] const node& at(keyframe_id k) const {
    assert(contains(k));
    return nodes_[k];
  }
  static void insert(std::vector<keyframe_id>& sorted, keyframe_id k) {
    const auto place = std::lower_bound(sorted.begin(), sorted.end(), k);
    if (place == sorted.end() || *place != k) sorted.insert(place, k);
  }
  static void remove(std::vector<keyframe_id>& sorted, keyframe_id k) {
    sorted.erase(std::lower_bound(sorted.begin(), sorted.end(), k));
  }
  void hang(keyframe_id k, keyframe_id parent) {
    nodes_[k].parent = parent;
    insert(nodes_[parent].children, k);
  }

  /// Prim's algorithm: the orphan with the strongest tie to what has a place already comes next.
  template <class Shared>
  void adopt(std::vector<keyframe_id> orphans, keyframe_id heir, Shared&& shared) {
    struct tie {
      std::uint32_t shared;
      keyframe_id to;
    };
    std::vector<tie> best;
    for (const keyframe_id k : orphans) best.push_back({static_cast<std::uint32_t>(shared(k, heir)), heir});
    while (!orphans.empty()) {
      std::size_t next = 0;
      for (std::size_t i = 1; i != orphans.size(); ++i)
        if (best[i].shared > best[next].shared) next = i;
      const keyframe_id placed = orphans[next];
      hang(placed, best[next].to);
      orphans.erase(orphans.begin() + static_cast<std::ptrdiff_t>(next));
      best.erase(best.begin() + static_cast<std::ptrdiff_t>(next));
      for (std::size_t i = 0; i != orphans.size(); ++i)
        if (const auto both = static_cast<std::uint32_t>(shared(orphans[i], placed)); both > best[i].shared)
          best[i] = {both, placed};
    }
  }

  std::vector<node> nodes_;  ///< by keyframe
  std::size_t size_ = 0;
  keyframe_id root_ = no_id;
};

}  // namespace orbis::slam

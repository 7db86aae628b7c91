// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The pruned octree of a store, made node by node: inner nodes hold the maximum of their children, eight
/// equal leaves are one leaf of twice the size. A reference for what the library finds without making it.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/octree/detail/storage/brick.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::test {

using namespace octree;
using namespace octree::detail;

/// What a node is: nothing is known there, one value for all of it, or children.
enum class node_kind : std::uint8_t { none, leaf, inner };

/// A node's kind, and its value: a leaf's own, or the maximum over an inner node's leaves.
template <class T>
struct node_entry {
  node_kind kind = node_kind::none;
  T value{};
};

/// What `pruned_tree::visit` reports to: `leaf(key, level, value)` and `inner(key, level, value, children)`.
template <class V, class T>
concept tree_visitor = requires(V& visitor, const voxel_key& key, int level, T value,
                                const std::array<node_entry<T>, 8>& children) {
  visitor.leaf(key, level, value);
  visitor.inner(key, level, value, children);
};

/// What eight children make of their parent.
template <class T>
[[nodiscard]] node_entry<T> parent_of(const std::array<node_entry<T>, 8>& children) noexcept {
  node_entry<T> parent;
  bool equal = true;
  for (const node_entry<T>& child : children) {
    equal = equal && child.kind == node_kind::leaf && child.value == children[0].value;
    if (child.kind == node_kind::none) continue;
    parent.value = parent.kind == node_kind::none ? child.value : std::max(parent.value, child.value);
    parent.kind = node_kind::inner;
  }
  if (equal) parent.kind = node_kind::leaf;
  return parent;
}

/// A snapshot of the tree's upper part over a store that must outlive it and stay as it is.
/// `Value` maps a voxel's value to the one the tree is to show. Building it takes
/// O(bricks log bricks + known voxels).
template <class T, class Value>
class pruned_tree {
 public:
  using entry = node_entry<T>;
  using children = std::array<entry, 8>;

  /// `root_level`: the depth of the tree, voxel_grid::depth().
  pruned_tree(const brick_store<T>& store, int root_level, Value value)
      : store_{store}, root_level_{root_level}, value_{value} {
    items_.reserve(store.brick_count() + store.large_count());
    store.for_each_brick([&](const brick<T>& b) {
      if (!b.is_known()) return;
      const children octants = octant_entries(b);
      items_.push_back({morton_order(named_key(b.name)), brick_level, &b, parent_of(octants), octants});
    });
    if (store.has_large()) {
      store.for_each_large([&](std::uint64_t name, T v) {
        items_.push_back({morton_order(named_key(name)), named_level(name), nullptr, {node_kind::leaf, value_(v)}, {}});
      });
      std::sort(items_.begin(), items_.end(), [](const item& a, const item& b) { return a.order < b.order; });
    }
    root_ = build(root_level, items_);
    // The root is never pruned away: files have no way to write a root without children.
    if (root_.value.kind == node_kind::leaf && items_.size() > 1) root_.value.kind = node_kind::inner;
  }

  /// Visits the nodes in preorder, children in the order of `child_key`:
  /// `visit.leaf(key, level, value)`, `visit.inner(key, level, value, children)`.
  template <tree_visitor<T> Visitor>
  void visit(Visitor&& visitor) const {
    if (root_.value.kind == node_kind::leaf) visitor.leaf(voxel_key{}, root_level_, root_.value.value);
    if (root_.value.kind == node_kind::inner) visit_upper(visitor, {}, root_level_, root_);
  }

 private:
  struct item {
    std::uint64_t order;  ///< Morton order of its lowest brick
    int level;
    const brick<T>* content;
    entry value;
    children octants;  ///< of a brick
  };
  struct node {
    entry value;
    std::uint32_t content = 0;   ///< a brick's place in items_
    std::uint32_t children = 0;  ///< their place in nodes_
  };

  [[nodiscard]] children voxel_entries(const octree::detail::block<T>& b, std::uint32_t group) const noexcept {
    children c;
    for (std::uint32_t i = 0; i != 8; ++i)
      if ((b.known >> (8 * group + i) & 1U) != 0) c[i] = {node_kind::leaf, value_(b.value[8 * group + i])};
    return c;
  }
  [[nodiscard]] children group_entries(const octree::detail::block<T>& b) const noexcept {
    children c;
    for (std::uint32_t i = 0; i != 8; ++i)
      if ((b.known >> (8 * i) & 0xffU) != 0) c[i] = parent_of(voxel_entries(b, i));
    return c;
  }
  [[nodiscard]] children octant_entries(const brick<T>& b) const noexcept {
    children c;
    octree::detail::block<T> voxels;
    for (std::uint32_t i = 0; i != 8; ++i) {
      if ((b.uniform >> i & 1U) != 0) c[i] = {node_kind::leaf, value_(b.value[i])};
      if ((b.dense >> i & 1U) == 0) continue;
      store_.read_octant(b, i, voxels);
      c[i] = parent_of(group_entries(voxels));
    }
    return c;
  }

  /// The node at `level` over `part` of the sorted items.
  [[nodiscard]] node build(int level, std::span<const item> part) {
    if (part.empty()) return {};
    if (part.front().level == level)
      return {part.front().value, static_cast<std::uint32_t>(part.data() - items_.data()), 0};
    const auto first = static_cast<std::uint32_t>(nodes_.size());
    nodes_.resize(nodes_.size() + 8);
    const auto shift = 3 * static_cast<unsigned>(level - 1 - brick_level);
    children c;
    for (std::uint32_t i = 0; i != 8; ++i) {
      const auto end =
          std::find_if(part.begin(), part.end(), [&](const item& it) { return (it.order >> shift & 7U) != i; });
      const auto count = static_cast<std::size_t>(end - part.begin());
      const node child = build(level - 1, part.first(count));
      part = part.subspan(count);
      nodes_[first + i] = child;
      c[i] = child.value;
    }
    return {parent_of(c), 0, first};
  }

  template <class Visitor>
  void visit_upper(Visitor& visitor, const voxel_key& key, int level, const node& at) const {
    if (level == brick_level) {
      visit_brick(visitor, key, at);
      return;
    }
    children c;
    for (std::uint32_t i = 0; i != 8; ++i) c[i] = nodes_[at.children + i].value;
    visit_children(visitor, key, level, at.value.value, c, [&](std::uint32_t i, const voxel_key& child, T) {
      visit_upper(visitor, child, level - 1, nodes_[at.children + i]);
    });
  }
  template <class Visitor>
  void visit_brick(Visitor& visitor, const voxel_key& key, const node& at) const {
    const brick<T>& b = *items_[at.content].content;
    visit_children(visitor, key, brick_level, at.value.value, items_[at.content].octants,
                   [&](std::uint32_t i, const voxel_key& octant, T max) {
                     octree::detail::block<T> voxels;
                     store_.read_octant(b, i, voxels);
                     visit_children(visitor, octant, octant_level, max, group_entries(voxels),
                                    [&](std::uint32_t j, const voxel_key& group, T m) {
                                      visit_children(visitor, group, 1, m, voxel_entries(voxels, j), [](auto&&...) {});
                                    });
                   });
  }
  template <class Visitor, class Inner>
  static void visit_children(Visitor& visitor, const voxel_key& key, int level, T max, const children& c,
                             Inner&& inner) {
    visitor.inner(key, level, max, c);
    for (std::uint32_t i = 0; i != 8; ++i) {
      const voxel_key child = child_key(key, i, node_cells(level - 1));
      if (c[i].kind == node_kind::leaf) visitor.leaf(child, level - 1, c[i].value);
      if (c[i].kind == node_kind::inner) inner(i, child, c[i].value);
    }
  }

  const brick_store<T>& store_;
  int root_level_;
  Value value_;
  std::vector<item> items_;
  std::vector<node> nodes_;
  node root_;
};

}  // namespace orbis::test

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The octree above and inside the bricks, as everybody else sees it: inner nodes hold the maximum
/// of their children, eight equal leaves are one leaf of twice the size.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/octree/brick.hpp>

namespace orbis::octree {

enum class node_kind : std::uint8_t { none, leaf, inner };

/// A node's kind, and its value: a leaf's own, or the maximum over an inner node's leaves.
template <class T>
struct node_entry {
  node_kind kind = node_kind::none;
  T value{};
};

/// What `pruned_tree::visit` reports to: `leaf(key, depth, value)` and `inner(key, depth, value, children)`.
template <class V, class T>
concept tree_visitor = requires(V& visitor, const voxel_key& key, int depth, T value,
                                const std::array<node_entry<T>, 8>& children) {
  visitor.leaf(key, depth, value);
  visitor.inner(key, depth, value, children);
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

/// The place of the brick that starts at `k` along the Morton curve: three bits for each level above it.
[[nodiscard]] constexpr std::uint64_t morton_order(const voxel_key& k) noexcept {
  std::uint64_t order = 0;
  for (unsigned bit = 3; bit != static_cast<unsigned>(tree_depth); ++bit)
    order |= std::uint64_t{(k.x >> bit & 1U) | (k.y >> bit & 1U) << 1U | (k.z >> bit & 1U) << 2U} << (3 * (bit - 3));
  return order;
}

/// A snapshot of the tree's upper part over a store that must outlive it and stay as it is.
/// `Value` maps a voxel's value to the one the tree is to show. Building it takes
/// O(bricks log bricks + known voxels).
template <class T, class Value>
class pruned_tree {
 public:
  using entry = node_entry<T>;
  using children = std::array<entry, 8>;

  pruned_tree(const brick_store<T>& store, Value value) : store_{store}, value_{value} {
    items_.reserve(store.bricks().size());
    for (std::uint32_t i = 0; i != store.bricks().size(); ++i) {
      const std::uint64_t name = store.bricks()[i].name;
      items_.push_back({morton_order(named_key(name)), brick_depth, i, brick_entry(store.bricks()[i])});
    }
    store.for_each_large([&](std::uint64_t name, T v) {
      items_.push_back({morton_order(named_key(name)), static_cast<int>(name >> 57U), 0, {node_kind::leaf, value_(v)}});
    });
    std::sort(items_.begin(), items_.end(), [](const item& a, const item& b) { return a.order < b.order; });
    root_ = build(0, items_);
    // The root is never pruned away: files have no way to write a root without children.
    if (root_.value.kind == node_kind::leaf && items_.size() > 1) root_.value.kind = node_kind::inner;
  }

  /// Visits the nodes in preorder, children in the order of `child_key`:
  /// `visit.leaf(key, depth, value)`, `visit.inner(key, depth, value, children)`.
  template <tree_visitor<T> Visitor>
  void visit(Visitor&& visitor) const {
    if (root_.value.kind == node_kind::leaf) visitor.leaf(voxel_key{}, 0, root_.value.value);
    if (root_.value.kind == node_kind::inner) visit_upper(visitor, {}, 0, root_);
  }

 private:
  struct item {
    std::uint64_t order;  ///< Morton order of its lowest brick
    int depth;
    std::uint32_t brick;
    entry value;
  };
  struct node {
    entry value;
    std::uint32_t link = 0;  ///< the children's place in nodes_, or the brick's number
  };

  [[nodiscard]] children voxel_entries(const block<T>& b, std::uint32_t group) const noexcept {
    children c;
    for (std::uint32_t i = 0; i != 8; ++i)
      if ((b.known >> (8 * group + i) & 1U) != 0) c[i] = {node_kind::leaf, value_(b.value[8 * group + i])};
    return c;
  }
  [[nodiscard]] children group_entries(const block<T>& b) const noexcept {
    children c;
    for (std::uint32_t i = 0; i != 8; ++i)
      if ((b.known >> (8 * i) & 0xffU) != 0) c[i] = parent_of(voxel_entries(b, i));
    return c;
  }
  [[nodiscard]] children octant_entries(const brick<T>& b) const noexcept {
    children c;
    for (std::uint32_t i = 0; i != 8; ++i) {
      if ((b.uniform >> i & 1U) != 0) c[i] = {node_kind::leaf, value_(b.value[i])};
      if ((b.dense >> i & 1U) != 0) c[i] = parent_of(group_entries(store_.block_at(b.at[i])));
    }
    return c;
  }
  [[nodiscard]] entry brick_entry(const brick<T>& b) const noexcept { return parent_of(octant_entries(b)); }

  /// The node at `depth` over `part` of the sorted items.
  [[nodiscard]] node build(int depth, std::span<const item> part) {
    if (part.empty()) return {};
    if (part.front().depth == depth) return {part.front().value, part.front().brick};
    const auto link = static_cast<std::uint32_t>(nodes_.size());
    nodes_.resize(nodes_.size() + 8);
    const auto shift = 3 * static_cast<unsigned>(brick_depth - depth - 1);
    children c;
    for (std::uint32_t i = 0; i != 8; ++i) {
      const auto end =
          std::find_if(part.begin(), part.end(), [&](const item& it) { return (it.order >> shift & 7U) != i; });
      const auto count = static_cast<std::size_t>(end - part.begin());
      const node child = build(depth + 1, part.first(count));
      part = part.subspan(count);
      nodes_[link + i] = child;
      c[i] = child.value;
    }
    return {parent_of(c), link};
  }

  template <class Visitor>
  void visit_upper(Visitor& visitor, const voxel_key& key, int depth, const node& at) const {
    if (depth == brick_depth) {
      visit_brick(visitor, key, at);
      return;
    }
    children c;
    for (std::uint32_t i = 0; i != 8; ++i) c[i] = nodes_[at.link + i].value;
    visitor.inner(key, depth, at.value.value, c);
    for (std::uint32_t i = 0; i != 8; ++i) {
      const voxel_key child = child_key(key, i, node_cells(depth + 1));
      if (c[i].kind == node_kind::leaf) visitor.leaf(child, depth + 1, c[i].value);
      if (c[i].kind == node_kind::inner) visit_upper(visitor, child, depth + 1, nodes_[at.link + i]);
    }
  }
  template <class Visitor>
  void visit_brick(Visitor& visitor, const voxel_key& key, const node& at) const {
    const brick<T>& b = store_.bricks()[at.link];
    visit_children(visitor, key, brick_depth, at.value.value, octant_entries(b),
                   [&](std::uint32_t i, const auto& octant, T max) {
                     const block<T>& voxels = store_.block_at(b.at[i]);
                     visit_children(visitor, octant, brick_depth + 1, max, group_entries(voxels),
                                    [&](std::uint32_t j, const auto& group, T m) {
                                      visit_children(visitor, group, brick_depth + 2, m, voxel_entries(voxels, j),
                                                     [](auto&&...) {});
                                    });
                   });
  }
  template <class Visitor, class Inner>
  static void visit_children(Visitor& visitor, const voxel_key& key, int depth, T max, const children& c,
                             Inner&& inner) {
    visitor.inner(key, depth, max, c);
    for (std::uint32_t i = 0; i != 8; ++i) {
      const voxel_key child = child_key(key, i, node_cells(depth + 1));
      if (c[i].kind == node_kind::leaf) visitor.leaf(child, depth + 1, c[i].value);
      if (c[i].kind == node_kind::inner) inner(i, child, c[i].value);
    }
  }

  const brick_store<T>& store_;
  Value value_;
  std::vector<item> items_;
  std::vector<node> nodes_;
  node root_;
};

}  // namespace orbis::octree

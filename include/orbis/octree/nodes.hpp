// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The octree at every resolution: the node of any size that contains a voxel. Inner nodes are not stored, except the
/// largest value of each octant; a policy makes their values of their children when they are asked for.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/octree/accessor.hpp>
#include <orbis/octree/detail/storage/brick.hpp>
#include <orbis/octree/detail/storage/tree_parts.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::octree {

/// What a node of the pruned octree is: nothing is known there, one value for all of it, or children.
enum class node_kind : std::uint8_t { none, leaf, inner };

/// Numbers of nodes of the pruned octree.
struct octree_counts {
  std::size_t nodes = 0;  ///< inner nodes and leaves
  std::size_t leaves = 0;
  std::size_t occupied_leaves = 0;
  std::size_t free_leaves = 0;
};

/// An inner node has the largest of its children's values: what may be hit is not overlooked. OctoMap
/// stores this.
struct max_of_children {
  template <sensor_model M>
  [[nodiscard]] static typename M::value_type carried(typename M::value_type v) noexcept {
    return v;
  }
  template <sensor_model M>
  [[nodiscard]] static typename M::value_type value(typename M::value_type v) noexcept {
    return v;
  }
  template <class C>
  static void take(C& so_far, int, const C& child) noexcept {
    so_far = std::max(so_far, child);
  }
};

/// An inner node has the mean of the probabilities of those children of which anything is known, each
/// with the same weight.
struct mean_of_children {
  template <sensor_model M>
  [[nodiscard]] static double carried(typename M::value_type v) noexcept {
    return probability_of(v);
  }
  template <sensor_model M>
  [[nodiscard]] static typename M::value_type value(double p) noexcept {
    return from_log_odds<M>(std::log(p / (1.0 - p)));
  }
  static void take(double& so_far, int count, double child) noexcept { so_far += (child - so_far) / (count + 1.0); }
};

/// What makes an inner node of its children: `carried` from a leaf's value to what is combined,
/// `take` adds a child to the `count` before it, `value` back.
template <class P, class M>
concept node_policy = sensor_model<M> && requires(typename M::value_type v) {
  { P::template value<M>(P::template carried<M>(v)) } -> std::same_as<typename M::value_type>;
};

namespace detail {

/// Nodes under a policy, each made of what is below it.
template <sensor_model Model, node_policy<Model> Policy>
class node_maker {
 public:
  using T = typename Model::value_type;
  using carried = decltype(Policy::template carried<Model>(T{}));
  struct entry {
    node_kind kind = node_kind::none;
    T leaf{};  ///< a leaf's value
    carried inner{};
    [[nodiscard]] T value() const noexcept {
      return kind == node_kind::inner ? Policy::template value<Model>(inner) : leaf;
    }
  };
  static constexpr bool is_max = std::same_as<Policy, max_of_children>;

  explicit node_maker(const brick_store<T>& store) noexcept : store_{store} {}

  [[nodiscard]] static entry leaf(T v) noexcept { return {node_kind::leaf, v, Policy::template carried<Model>(v)}; }
  [[nodiscard]] static entry voxel(const octant_view<T>& o, std::uint32_t place) noexcept {
    return (o.known >> place & 1U) != 0 ? leaf(o.at(place)) : entry{};
  }
  /// 2x2x2 voxels, of which `place` is the lowest.
  [[nodiscard]] static entry group(const octant_view<T>& o, std::uint32_t place) noexcept {
    return parent([&](std::uint32_t i) { return voxel(o, place + i); });
  }
  [[nodiscard]] entry octant(const brick<T>& b, std::uint32_t i) const noexcept {
    if ((b.uniform >> i & 1U) != 0) return leaf(b.value[i]);
    if ((b.dense >> i & 1U) == 0) return {};
    if constexpr (is_max) return {node_kind::inner, {}, b.value[i]};
    const octant_view<T> o = store_.view(b, i);
    return parent([&](std::uint32_t g) { return group(o, 8 * g); });
  }
  [[nodiscard]] entry whole(const brick<T>& b) const noexcept {
    return parent([&](std::uint32_t i) { return octant(b, i); });
  }
  /// The node at `level` over its parts, in Morton order.
  [[nodiscard]] entry over(int level, std::span<const tree_part<T>> parts) const {
    if (parts.empty()) return {};
    if (parts.front().content == nullptr && parts.front().level >= level) return leaf(parts.front().value);
    if (level == brick_level) return whole(*parts.front().content);
    const auto shift = 3 * static_cast<unsigned>(level - 1 - brick_level);
    return parent([&](std::uint32_t i) {
      const auto end =
          std::find_if(parts.begin(), parts.end(), [&](const auto& p) { return (p.order >> shift & 7U) != i; });
      const auto count = static_cast<std::size_t>(end - parts.begin());
      const entry child = over(level - 1, parts.first(count));
      parts = parts.subspan(count);
      return child;
    });
  }

 private:
  /// `child(i)` for i = 0 ... 7, in this order.
  template <class Child>
  [[nodiscard]] static entry parent(Child&& child) {
    entry made;
    int count = 0;
    bool equal = true;
    for (std::uint32_t i = 0; i != 8; ++i) {
      const entry c = child(i);
      if (i == 0) made.leaf = c.leaf;
      equal = equal && c.kind == node_kind::leaf && c.leaf == made.leaf;
      if (c.kind == node_kind::none) continue;
      if (count == 0)
        made.inner = c.inner;
      else
        Policy::take(made.inner, count, c.inner);
      ++count;
    }
    made.kind = equal ? node_kind::leaf : count != 0 ? node_kind::inner : node_kind::none;
    return made;
  }

  const brick_store<T>& store_;
};

/// The bricks and larger leaves inside the node at `level` >= chunk_level that contains `k`, or the
/// leaf it lies in, in Morton order.
template <class T>
[[nodiscard]] std::vector<tree_part<T>> parts_inside(const brick_store<T>& store, const voxel_key& k, int level) {
  std::vector<tree_part<T>> parts;
  const auto add = [&](const typename brick_store<T>::chunk& c) {
    for (std::uint32_t place = 0; place != 64; ++place)
      if (const brick<T>* const b = store.find(c, place); b != nullptr && b->is_known()) {
        const voxel_key key = named_key(b->name);
        parts.push_back({morton_order(key), key, brick_level, b, b->value[0]});
      }
  };
  const voxel_key low = node_key(k, level);
  if (level == chunk_level) {
    if (const auto* const c = store.find_chunk(k)) add(*c);
  } else {
    store.for_each_chunk([&](const auto& c) {
      if (node_key(named_key(c.name), level) == low) add(c);
    });
  }
  if (store.has_large()) {
    store.for_each_large([&](std::uint64_t name, T v) {
      const voxel_key key = named_key(name);
      const int larger = std::max(level, named_level(name));
      if (node_key(key, larger) == node_key(k, larger))
        parts.push_back({morton_order(key), key, named_level(name), nullptr, v});
    });
    std::sort(parts.begin(), parts.end(), [](const auto& a, const auto& b) { return a.order < b.order; });
  }
  return parts;
}

/// The node at `level` that contains `k`.
template <sensor_model Model, class Policy>
[[nodiscard]] auto make_node(const brick_store<typename Model::value_type>& store, const voxel_key& k, int level) {
  using T = typename Model::value_type;
  const node_maker<Model, Policy> make{store};
  using entry = typename node_maker<Model, Policy>::entry;
  const brick<T>* const b = store.find(k);
  if (level <= brick_level && (b == nullptr || !b->is_known())) {
    const T* const large = store.find_large_value(k);
    return large == nullptr ? entry{} : make.leaf(*large);
  }
  const std::uint32_t place = place_in_brick(k);
  switch (level) {
    case 0: return make.voxel(store.view(*b, place >> 6U), place & 63U);
    case 1: return make.group(store.view(*b, place >> 6U), place & 56U);
    case octant_level: return make.octant(*b, place >> 6U);
    case brick_level: return make.whole(*b);
    default: break;
  }
  std::vector<tree_part<T>> parts = parts_inside(store, k, std::max(level, chunk_level));
  if (level < chunk_level)
    std::erase_if(parts, [&](const auto& p) {
      const int larger = std::max(level, p.level);
      return node_key(p.key, larger) != node_key(k, larger);
    });
  return make.over(level, parts);
}

}  // namespace detail

/// A node of the pruned octree as seen at one depth.
template <class T>
struct octree_node {
  node_kind kind = node_kind::none;  ///< none: nothing is known; leaf: one value, or part of a larger leaf
  T value{};                         ///< a leaf's, or what the policy makes of the children

  [[nodiscard]] bool is_known() const noexcept { return kind != node_kind::none; }
};

/// The node at `depth` (0: the root, grid depth: a voxel) that contains voxel `k`, inner nodes as
/// `Policy` makes them. With max_of_children it is what OctoMap's `search(key, depth)` finds.
///
/// O(1) up to the size of a brick with max_of_children, O(voxels in the node) otherwise; O(bricks in
/// the node + chunks of the map) above. @pre 0 <= depth <= grid depth
template <octree_map Map, node_policy<typename Map::model> Policy = max_of_children>
[[nodiscard]] octree_node<typename Map::model::value_type> find_node(const Map& map, const voxel_key& k, int depth,
                                                                     Policy = {}) {
  assert(0 <= depth && depth <= map.grid().depth());
  const auto made = detail::make_node<typename Map::model, Policy>(map.store(), k, map.grid().depth() - depth);
  return {made.kind, made.kind == node_kind::none ? typename Map::model::value_type{} : made.value()};
}
/// The node at `depth` that contains the point `p` (metres); none outside the grid. See above.
template <octree_map Map, point_like P, node_policy<typename Map::model> Policy = max_of_children>
[[nodiscard]] octree_node<typename Map::model::value_type> find_node(const Map& map, const P& p, int depth,
                                                                     Policy policy = {}) {
  const auto key = map.grid().key(p);
  return key ? find_node(map, *key, depth, policy) : octree_node<typename Map::model::value_type>{};
}
/// What is known about the node at `depth` that contains `p`, a point or a voxel.
template <octree_map Map, class P, node_policy<typename Map::model> Policy = max_of_children>
requires point_like<P> || std::same_as<P, voxel_key>
[[nodiscard]] occupancy node_state(const Map& map, const P& p, int depth, Policy policy = {}) {
  const auto node = find_node(map, p, depth, policy);
  if (!node.is_known()) return occupancy::unknown;
  return is_occupied<typename Map::model>(node.value) ? occupancy::occupied : occupancy::free;
}

}  // namespace orbis::octree

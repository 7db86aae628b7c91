// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Visits the leaves of the pruned octree, which are derived from the bricks.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/core/bits.hpp>
#include <orbis/octree/detail/storage/brick.hpp>
#include <orbis/octree/detail/storage/tree_parts.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::octree {

/// Node counts of the pruned octree.
struct octree_counts {
  std::size_t nodes = 0;  ///< inner nodes and leaves
  std::size_t leaves = 0;
  std::size_t occupied_leaves = 0;
  std::size_t free_leaves = 0;
};

}  // namespace orbis::octree

namespace orbis::octree::detail {

inline constexpr std::uint64_t low_bits = 0x0101010101010101;  ///< the first voxel of each group of eight

/// Returns a mask; bit 8 i is set if byte i of `mask` is not zero.
[[nodiscard]] constexpr std::uint64_t bytes_with_any(std::uint64_t mask) noexcept {
  constexpr std::uint64_t rest = 0x7f * low_bits;
  return (((mask & rest) + rest) | mask) >> 7U & low_bits;
}
/// Leaves of an octant that is not a leaf itself.
struct octant_leaves {
  std::uint64_t first;      ///< lowest voxel of each leaf
  std::uint64_t large;      ///< lowest voxel of each leaf of 2x2x2 voxels, a subset of `first`
  std::size_t inner_nodes;  ///< number of inner nodes: the octant, and its groups of 2x2x2 voxels that are not leaves
};
template <class T>
[[nodiscard]] octant_leaves find_leaves(const octant_view<T>& o) noexcept {
  std::uint64_t large = 0;
  if (o.bits <= max_palette_bits) {  // equal values have equal indices
    std::uint64_t differs = ~o.known;
    for (unsigned j = 0; j != o.bits; ++j) differs |= (o.plane[j] ^ o.plane[j] >> 1U) & 0x7f * low_bits;
    large = low_bits & ~bytes_with_any(differs);
  } else {
    for (unsigned g = 0; g != 64; g += 8) {
      bool equal = (o.known >> g & 0xffU) == 0xff;
      for (unsigned i = 1; i != 8; ++i) equal &= o.value[g + i] == o.value[g];
      large |= std::uint64_t{equal} << g;
    }
  }
  const std::uint64_t inner = bytes_with_any(o.known) & ~large;
  return {(o.known & inner * 0xff) | large, large, 1 + count_ones(inner)};
}
/// Offset of the voxel at each place in an octant.
inline constexpr auto octant_offsets = [] {
  std::array<voxel_key, 64> offsets{};
  for (std::uint32_t i = 0; i != 64; ++i) offsets[i] = voxel_in_brick(i);
  return offsets;
}();
[[nodiscard]] constexpr voxel_key voxel_in_octant(const voxel_key& octant, std::uint32_t place) noexcept {
  const voxel_key& k = octant_offsets[place];
  return {octant.x + k.x, octant.y + k.y, octant.z + k.z};
}

/// Calls `on_leaf(key, level, value)` for leaves at least as large as an octant. Calls `on_octant(key, brick, i)`,
/// which returns the number of inner nodes in the octant, for the other octants. Returns the total number of inner
/// nodes.
template <class T, class OnLeaf, class OnOctant>
std::size_t walk_octants(const std::vector<tree_part<T>>& parts, int root_level, OnLeaf&& on_leaf,
                         OnOctant&& on_octant) {
  std::size_t inner = 0;
  for (std::size_t i = 0; i != parts.size(); ++i) {
    const tree_part<T>& part = parts[i];
    // Count the ancestors of the part, except those shared with the previous part.
    const auto differing = static_cast<int>(i == 0 ? 0 : std::bit_width(part.order ^ parts[i - 1].order));
    const int lowest_common = i == 0 ? root_level + 1 : brick_level + (differing + 2) / 3;
    inner += static_cast<std::size_t>(lowest_common - 1 - part.level);
    if (part.content == nullptr) {
      on_leaf(part.key, part.level, part.value);
      continue;
    }
    ++inner;
    const brick<T>& b = *part.content;
    for (std::uint32_t o = 0; o != 8; ++o) {
      const voxel_key octant = child_key(part.key, o, node_cells(octant_level));
      if ((b.uniform >> o & 1U) != 0)
        on_leaf(octant, octant_level, b.value[o]);
      else if ((b.dense >> o & 1U) != 0)
        inner += on_octant(octant, b, o);
    }
  }
  return inner;
}

/// Calls `visit(key, level, value)` for the leaves of a dense octant. Returns the number of inner nodes.
template <class T, class Visit>
std::size_t visit_octant(const voxel_key& key, const octant_view<T>& o, block<T>& scratch, Visit&& visit) {
  const T* value = o.value;
  if (o.bits <= max_palette_bits) {
    scratch.known = o.known;
    expand_palette(o.value, o.plane, o.bits, scratch);
    value = scratch.value.data();
  }
  const octant_leaves leaves = find_leaves(o);
  for (std::uint64_t rest = leaves.first; rest != 0; rest &= rest - 1) {
    const auto i = static_cast<std::uint32_t>(std::countr_zero(rest));
    visit(voxel_in_octant(key, i), static_cast<int>(leaves.large >> i & 1U), value[i]);
  }
  return leaves.inner_nodes;
}

/// Visits the leaves of the given parts of a store.
template <class T, class Visit>
std::size_t visit_parts(const brick_store<T>& store, const std::vector<tree_part<T>>& parts, int root_level,
                        Visit&& visit) {
  block<T> scratch;
  return walk_octants(parts, root_level, visit, [&](const voxel_key& key, const brick<T>& b, std::uint32_t i) {
    return visit_octant(key, store.view(b, i), scratch, visit);
  });
}

/// Calls `visit(key, level, value)` for every leaf of the pruned octree whose root is at `root_level`, in Morton order.
/// Returns the number of inner nodes. O(known voxels).
template <class T, std::invocable<const voxel_key&, int, T> Visit>
std::size_t visit_leaves(const brick_store<T>& store, int root_level, Visit&& visit) {
  return visit_parts(store, tree_parts(store, root_level), root_level, visit);
}

/// Counts the nodes of the pruned octree. O(bricks + octants that are not uniform).
template <sensor_model Model>
[[nodiscard]] octree_counts count_leaves(const brick_store<typename Model::value_type>& store, int root_level) {
  using T = typename Model::value_type;
  octree_counts n;
  const auto on_leaf = [&](const voxel_key&, int, T v) {
    ++n.leaves;
    n.occupied_leaves += is_occupied<Model>(v) ? 1 : 0;
  };
  const auto on_octant = [&](const voxel_key&, const brick<T>& b, std::uint32_t i) {
    const octant_leaves leaves = find_leaves(store.view(b, i));
    n.leaves += count_ones(leaves.first);
    if (is_occupied<Model>(b.value[i]))
      n.occupied_leaves += count_ones(leaves.first & store.voxels_where(b, i, is_occupied<Model>));
    return leaves.inner_nodes;
  };
  n.nodes = walk_octants(tree_parts(store, root_level), root_level, on_leaf, on_octant);
  n.free_leaves = n.leaves - n.occupied_leaves;
  n.nodes += n.leaves;
  return n;
}

}  // namespace orbis::octree::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Names of nodes, and their order. All orders are Morton orders (x lowest, then y, then z): the eight children of a
/// node are contiguous, a byte of a 64-bit mask is a node of 2x2x2 voxels, and a mask is an octant of 4x4x4.
#pragma once

#include <cstdint>

#include <orbis/octree/key.hpp>

namespace orbis::octree::detail {

/// Levels at which the storage format changes: an octant of 4x4x4 voxels, a brick of eight octants, a chunk of 4x4x4
/// bricks.
inline constexpr int octant_level = 2;
inline constexpr int brick_level = 3;
inline constexpr int chunk_level = 5;

/// Moves bits 0, 1, 2 to bits 0, 3, 6.
[[nodiscard]] constexpr std::uint32_t spread3(std::uint32_t v) noexcept {
  return (v & 1U) | (v & 2U) << 2U | (v & 4U) << 4U;
}
/// Place of a voxel in its brick: bits 0-5 are the place in the octant, bits 6-8 the octant.
[[nodiscard]] constexpr std::uint32_t place_in_brick(const voxel_key& k) noexcept {
  return spread3(k.x) | spread3(k.y) << 1U | spread3(k.z) << 2U;
}
/// Place of a voxel in its octant.
[[nodiscard]] constexpr std::uint32_t place_in_octant(const voxel_key& k) noexcept { return place_in_brick(k) & 63U; }
/// Voxel at a place in a brick, relative to the lowest voxel of the brick.
[[nodiscard]] constexpr voxel_key voxel_in_brick(std::uint32_t place) noexcept {
  const auto gather = [](std::uint32_t v) { return (v & 1U) | (v >> 2U & 2U) | (v >> 4U & 4U); };
  return {gather(place), gather(place >> 1U), gather(place >> 2U)};
}
/// Place of a brick in its chunk, and the lowest voxel of the brick at a place, relative to the chunk.
[[nodiscard]] constexpr std::uint32_t place_in_chunk(const voxel_key& k) noexcept {
  return place_in_brick({k.x >> 3U & 3U, k.y >> 3U & 3U, k.z >> 3U & 3U});
}
[[nodiscard]] constexpr voxel_key brick_in_chunk(std::uint32_t place) noexcept {
  const voxel_key k = voxel_in_brick(place);
  return {k.x << 3U, k.y << 3U, k.z << 3U};
}

/// Name of the node at `level` that contains `k`, unique among all nodes of all levels; never ~0.
[[nodiscard]] constexpr std::uint64_t node_name(const voxel_key& k, int level) noexcept {
  const auto s = static_cast<unsigned>(level);
  return std::uint64_t{k.x >> s} | std::uint64_t{k.y >> s} << 19U | std::uint64_t{k.z >> s} << 38U |
         std::uint64_t{s} << 57U;
}
/// Level of a named node, and its lowest voxel. @pre level >= octant_level
[[nodiscard]] constexpr int named_level(std::uint64_t name) noexcept { return static_cast<int>(name >> 57U); }
[[nodiscard]] constexpr voxel_key named_key(std::uint64_t name) noexcept {
  const auto s = static_cast<unsigned>(named_level(name));
  const auto part = [&](unsigned shift) { return static_cast<std::uint32_t>(name >> shift & 0x7ffffU) << s; };
  return {part(0), part(19), part(38)};
}

/// Position along the Morton curve of the brick that contains `k`: three bits per level above it.
[[nodiscard]] constexpr std::uint64_t morton_order(const voxel_key& k) noexcept { return morton_code(k) >> 9U; }

static_assert(max_tree_depth - octant_level <= 19, "a node's name has 19 bits for each axis");

}  // namespace orbis::octree::detail

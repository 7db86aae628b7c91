// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Voxel keys: conversion of coordinates to voxels, bit-identical to OctoMap's; boxes of voxels; and the order of
/// voxels along the Morton curve.
#pragma once

#include <cassert>
#include <cmath>
#include <cstdint>
#include <optional>

#include <orbis/core/point.hpp>
#include <orbis/core/rounded.hpp>
#include <orbis/core/types.hpp>

namespace orbis::octree {

/// Default tree depth, which is that of OctoMap, and maximum tree depth.
///
/// The *level* of a node counts from the bottom: 0 is a voxel; in general it is `tree depth - depth`. Stored data
/// contain only levels and thus do not depend on the extent of the grid.
inline constexpr int default_tree_depth = 16;
inline constexpr int max_tree_depth = 21;

/// Position of a voxel in the grid: 0 ... cells() - 1 along each axis; the world's origin is at the lower corner of the
/// middle voxel, (32768, 32768, 32768) at depth 16. A node is identified by its lowest voxel.
struct voxel_key {
  std::uint32_t x = 0, y = 0, z = 0;
  friend constexpr bool operator==(const voxel_key&, const voxel_key&) = default;
};

/// Key of the i-th child of a node: bit 0 of `i` is x, bit 1 is y, bit 2 is z. `size`: edge of the child in voxels.
[[nodiscard]] constexpr voxel_key child_key(const voxel_key& parent, unsigned i, std::uint32_t size) noexcept {
  return {parent.x + (i & 1U) * size, parent.y + (i >> 1U & 1U) * size, parent.z + (i >> 2U & 1U) * size};
}

/// Edge of a node at `level`, in voxels.
[[nodiscard]] constexpr std::uint32_t node_cells(int level) noexcept {
  return std::uint32_t{1} << static_cast<unsigned>(level);
}
/// Lowest voxel of the node at `level` that contains `k`.
[[nodiscard]] constexpr voxel_key node_key(const voxel_key& k, int level) noexcept {
  const std::uint32_t outside = ~(node_cells(level) - 1);
  return {k.x & outside, k.y & outside, k.z & outside};
}

/// A regular grid of voxels.
class voxel_grid {
 public:
  /// `resolution`: the edge of a voxel, metres. `depth`: the grid is 2^depth voxels wide, centred at
  /// the world's origin. @pre resolution finite and > 0; 5 <= depth <= max_tree_depth
  explicit voxel_grid(double resolution, int depth = default_tree_depth) noexcept
      : resolution_{resolution}, per_metre_{1.0 / resolution}, depth_{depth}, half_{std::ldexp(1.0, depth - 1)} {
    assert(std::isfinite(resolution) && resolution > 0.0);
    assert(5 <= depth && depth <= max_tree_depth);
  }

  [[nodiscard]] double resolution() const noexcept { return resolution_; }
  /// Number of levels below the root.
  [[nodiscard]] int depth() const noexcept { return depth_; }
  /// Number of voxels along one axis.
  [[nodiscard]] std::uint32_t cells() const noexcept { return std::uint32_t{1} << static_cast<unsigned>(depth_); }

  /// Returns the key along one axis; empty outside the grid and for NaN.
  [[nodiscard]] std::optional<std::uint32_t> key(double coordinate) const noexcept {
    const double cells = per_metre_ * coordinate;
    if (!(cells >= -half_ && cells < half_)) return std::nullopt;
    auto cell = static_cast<std::int32_t>(cells);  // towards zero; floor() would be a function call
    cell -= static_cast<double>(cell) > cells ? 1 : 0;
    return static_cast<std::uint32_t>(cell + static_cast<std::int32_t>(half_));
  }
  /// Returns the voxel that contains `p` (metres); empty outside the grid and for NaN.
  template <point_like P>
  [[nodiscard]] std::optional<voxel_key> key(const P& p) const noexcept {
    const auto c = coordinates<double>(p);
    const auto x = key(c[0]);
    const auto y = key(c[1]);
    const auto z = key(c[2]);
    if (!x || !y || !z) return std::nullopt;
    return voxel_key{*x, *y, *z};
  }

  /// Centre of voxel `k` along one axis, metres.
  [[nodiscard]] double center(std::uint32_t k) const noexcept {
    const auto cells = static_cast<double>(static_cast<std::int32_t>(k) - static_cast<std::int32_t>(half_));
    return rounded_product(cells + 0.5, resolution_);
  }
  [[nodiscard]] vec3 center(const voxel_key& k) const noexcept { return {center(k.x), center(k.y), center(k.z)}; }
  /// Centre of the node at `level` whose lowest voxel is `k`, metres.
  [[nodiscard]] vec3 center(const voxel_key& k, int level) const noexcept {
    const double cells = node_cells(level);
    const auto along = [&](std::uint32_t c) {
      return rounded_product((static_cast<double>(c) - half_) / cells + 0.5, resolution_ * cells);
    };
    return level == depth_ ? vec3(zeros<vec3>()) : vec3{along(k.x), along(k.y), along(k.z)};
  }
  /// Edge of a node at `level`, metres.
  [[nodiscard]] double node_size(int level) const noexcept { return resolution_ * node_cells(level); }
  friend bool operator==(const voxel_grid&, const voxel_grid&) = default;

 private:
  double resolution_;
  double per_metre_;
  int depth_;
  double half_;  ///< half the grid's width, in voxels
};

// -- the Morton curve

/// Position of voxel `k` along the Morton curve: the interleaved bits of x, y and z (x lowest), 63 bits in total. The
/// six lowest bits are the voxel's position in its octant of 4x4x4 voxels; the others are the octant's code.
///
/// G. M. Morton, "A computer oriented geodetic data base and a new technique in file sequencing", IBM, 1966.
/// @pre coordinates < 2^21
[[nodiscard]] constexpr std::uint64_t morton_code(const voxel_key& k) noexcept {
  assert(((k.x | k.y | k.z) >> 21U) == 0);
  const auto spread = [](std::uint64_t v) {  // inserts two zeros after each bit
    v = (v | v << 32U) & 0x001f00000000ffffULL;
    v = (v | v << 16U) & 0x001f0000ff0000ffULL;
    v = (v | v << 8U) & 0x100f00f00f00f00fULL;
    v = (v | v << 4U) & 0x10c30c30c30c30c3ULL;
    return (v | v << 2U) & 0x1249249249249249ULL;
  };
  return spread(k.x) | spread(k.y) << 1U | spread(k.z) << 2U;
}

/// Voxel at a position along the Morton curve. @pre code < 2^63
[[nodiscard]] constexpr voxel_key morton_key(std::uint64_t code) noexcept {
  const auto gather = [](std::uint64_t v) {
    v &= 0x1249249249249249ULL;
    v = (v | v >> 2U) & 0x10c30c30c30c30c3ULL;
    v = (v | v >> 4U) & 0x100f00f00f00f00fULL;
    v = (v | v >> 8U) & 0x001f0000ff0000ffULL;
    v = (v | v >> 16U) & 0x001f00000000ffffULL;
    return static_cast<std::uint32_t>((v | v >> 32U) & 0x1fffffULL);
  };
  return {gather(code), gather(code >> 1U), gather(code >> 2U)};
}

// -- boxes

/// An axis-aligned box, metres.
struct bounding_box {
  vec3 min = zeros<vec3>();
  vec3 max = zeros<vec3>();
};

/// Cube of the node at `level` whose lowest voxel is `k`, metres.
[[nodiscard]] inline bounding_box node_cube(const voxel_grid& grid, const voxel_key& k, int level) {
  const double half = grid.cells() / 2, cells = node_cells(level);
  const vec3 low{static_cast<double>(k.x) - half, static_cast<double>(k.y) - half, static_cast<double>(k.z) - half};
  return {low * grid.resolution(), shifted(low, cells) * grid.resolution()};
}
[[deprecated("use node_cube")]] [[nodiscard]] inline bounding_box cube_of(const voxel_grid& grid, const voxel_key& k,
                                                                          int level) {
  return node_cube(grid, k, level);
}

/// Box of the voxels from `low` to `high`, both included.
struct key_box {
  voxel_key low, high;

  /// Returns true if the node at `level` whose lowest voxel is `k` has a voxel in the box.
  [[nodiscard]] constexpr bool overlaps(const voxel_key& k, int level) const noexcept {
    const std::uint32_t last = node_cells(level) - 1;
    return k.x <= high.x && k.y <= high.y && k.z <= high.z && k.x + last >= low.x && k.y + last >= low.y &&
           k.z + last >= low.z;
  }
};

/// Voxels of the box from `min` to `max` (metres), clipped to the grid; empty if the box is outside the grid, if min >
/// max along an axis, and for NaN.
[[nodiscard]] inline std::optional<key_box> keys_between(const voxel_grid& grid, const vec3& min, const vec3& max) {
  const double half = grid.resolution() * (grid.cells() / 2);
  const auto clamped = [&](double c, std::uint32_t beyond) { return grid.key(c).value_or(c < 0.0 ? 0 : beyond); };
  const auto axis = [&](int i, std::uint32_t& low, std::uint32_t& high) {
    if (!(min[i] <= max[i] && min[i] < half && max[i] >= -half)) return false;
    low = clamped(min[i], grid.cells() - 1);
    high = clamped(max[i], grid.cells() - 1);
    return true;
  };
  key_box box;
  if (!axis(0, box.low.x, box.high.x) || !axis(1, box.low.y, box.high.y) || !axis(2, box.low.z, box.high.z))
    return std::nullopt;
  return box;
}

}  // namespace orbis::octree

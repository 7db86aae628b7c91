// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Voxel keys: which voxel a coordinate lies in, to the last bit as OctoMap computes it.
#pragma once

#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <optional>

#include <orbis/core/point.hpp>
#include <orbis/core/rounded.hpp>
#include <orbis/core/types.hpp>

namespace orbis::octree {

/// The depth of OctoMap's trees, and ours unless told otherwise; the deepest there can be.
///
/// A node's *level* counts from below: 0 is a voxel, `tree depth - depth` in general. What is stored
/// knows levels only, so that it does not depend on how far the grid reaches.
inline constexpr int default_tree_depth = 16;
inline constexpr int max_tree_depth = 21;

/// A voxel's place in the grid: 0 ... cells() - 1 along each axis; the world's origin is the lower
/// corner of the middle voxel, (32768, 32768, 32768) at depth 16. A node is named by its lowest voxel.
struct voxel_key {
  std::uint32_t x = 0, y = 0, z = 0;
  friend constexpr bool operator==(const voxel_key&, const voxel_key&) = default;
};

/// The i-th child of a node: bit 0 of `i` is x, bit 1 is y, bit 2 is z. `size`: of the child, in voxels.
[[nodiscard]] constexpr voxel_key child_key(const voxel_key& parent, unsigned i, std::uint32_t size) noexcept {
  return {parent.x + (i & 1U) * size, parent.y + (i >> 1U & 1U) * size, parent.z + (i >> 2U & 1U) * size};
}

/// The edge of a node at `level`, in voxels.
[[nodiscard]] constexpr std::uint32_t node_cells(int level) noexcept {
  return std::uint32_t{1} << static_cast<unsigned>(level);
}
/// The lowest voxel of the node at `level` that contains `k`.
[[nodiscard]] constexpr voxel_key node_key(const voxel_key& k, int level) noexcept {
  const std::uint32_t outside = ~(node_cells(level) - 1);
  return {k.x & outside, k.y & outside, k.z & outside};
}

/// The regular grid of voxels.
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
  /// The number of levels below the root.
  [[nodiscard]] int depth() const noexcept { return depth_; }
  /// The number of voxels along one axis.
  [[nodiscard]] std::uint32_t cells() const noexcept { return std::uint32_t{1} << static_cast<unsigned>(depth_); }

  /// The key along one axis; empty outside the grid and for NaN.
  [[nodiscard]] std::optional<std::uint32_t> key(double coordinate) const noexcept {
    const double cells = per_metre_ * coordinate;
    if (!(cells >= -half_ && cells < half_)) return std::nullopt;
    auto cell = static_cast<std::int32_t>(cells);  // towards zero; floor() would be a call
    cell -= static_cast<double>(cell) > cells ? 1 : 0;
    return static_cast<std::uint32_t>(cell + static_cast<std::int32_t>(half_));
  }
  /// The voxel that `p` (metres) lies in; empty outside the grid and for NaN.
  template <point_like P>
  [[nodiscard]] std::optional<voxel_key> key(const P& p) const noexcept {
    const auto c = coordinates<double>(p);
    const auto x = key(c[0]);
    const auto y = key(c[1]);
    const auto z = key(c[2]);
    if (!x || !y || !z) return std::nullopt;
    return voxel_key{*x, *y, *z};
  }

  /// The centre of voxel `k` along one axis, metres.
  [[nodiscard]] double center(std::uint32_t k) const noexcept {
    const auto cells = static_cast<double>(static_cast<std::int32_t>(k) - static_cast<std::int32_t>(half_));
    return rounded_product(cells + 0.5, resolution_);
  }
  [[nodiscard]] vec3 center(const voxel_key& k) const noexcept { return {center(k.x), center(k.y), center(k.z)}; }
  /// The centre of the node at `level` whose lowest voxel is `k`, metres.
  [[nodiscard]] vec3 center(const voxel_key& k, int level) const noexcept {
    const double cells = node_cells(level);
    const auto along = [&](std::uint32_t c) {
      return rounded_product((static_cast<double>(c) - half_) / cells + 0.5, resolution_ * cells);
    };
    return level == depth_ ? vec3(vec3::Zero()) : vec3{along(k.x), along(k.y), along(k.z)};
  }
  /// The edge of a node at `level`, metres.
  [[nodiscard]] double node_size(int level) const noexcept { return resolution_ * node_cells(level); }
  friend bool operator==(const voxel_grid&, const voxel_grid&) = default;

 private:
  double resolution_;
  double per_metre_;
  int depth_;
  double half_;  ///< of the grid's width, in voxels
};

}  // namespace orbis::octree

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Axis-aligned boxes, in metres and in voxels.
#pragma once

#include <cstdint>
#include <optional>

#include <orbis/core/types.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::octree {

/// An axis-aligned box, metres.
struct bounding_box {
  vec3 min = vec3::Zero();
  vec3 max = vec3::Zero();
};

/// The cube of the node at `level` whose lowest voxel is `k`, metres.
[[nodiscard]] inline bounding_box cube_of(const voxel_grid& grid, const voxel_key& k, int level) {
  const double half = grid.cells() / 2, cells = node_cells(level);
  const vec3 low = vec3{static_cast<double>(k.x), static_cast<double>(k.y), static_cast<double>(k.z)}.array() - half;
  return {low * grid.resolution(), vec3(low.array() + cells) * grid.resolution()};
}

/// The voxels from `low` to `high`, both included.
struct key_box {
  voxel_key low, high;

  /// Whether the node at `level` whose lowest voxel is `k` has a voxel in the box.
  [[nodiscard]] constexpr bool overlaps(const voxel_key& k, int level) const noexcept {
    const std::uint32_t last = node_cells(level) - 1;
    return k.x <= high.x && k.y <= high.y && k.z <= high.z && k.x + last >= low.x && k.y + last >= low.y &&
           k.z + last >= low.z;
  }
};

/// The voxels of the box from `min` to `max` (metres), as far as it lies in the grid; empty if none of
/// it does, if min > max along an axis, and for NaN.
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

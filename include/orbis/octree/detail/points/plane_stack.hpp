// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Rays through a stack of parallel planes of voxel faces, and the byte maps in which their crossings are marked.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace orbis::octree::detail {

/// Rays that go forward along one axis. After its j-th plane (j = 1, 2 ... planes) a ray is in the cell
/// (floor(u + j * du), floor(v + j * dv)), counted from the one it starts in. @pre |du|, |dv| <= 1
struct queued_rays {
  static constexpr std::size_t lanes = 16;
  std::vector<double> u, du, v, dv;
  std::vector<std::int32_t> planes;
  std::vector<std::uint32_t> id;

  /// Room for `count` rays, and for a whole group of lanes after any of them.
  void fit(std::size_t count) {
    if (planes.size() >= count + lanes) return;
    u.resize(count + lanes);
    du.resize(count + lanes);
    v.resize(count + lanes);
    dv.resize(count + lanes);
    planes.resize(count + lanes);
    id.resize(count + lanes);
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return planes.capacity() * (4 * sizeof(double) + sizeof(std::int32_t) + sizeof(std::uint32_t));
  }
};

/// Some consecutive planes and the layers of voxels between them, each a map of bytes in tiles of 8x8,
/// a tile being a line of the cache and a layer of a brick. A byte of a plane says that a ray passes
/// through there: the voxels on both sides are crossed. A byte of a layer is a voxel that a ray enters
/// and leaves between two planes.
struct plane_stack {
  static constexpr unsigned fraction = 22;     ///< bits of a coordinate's fraction; ten are left for the cell
  static constexpr std::uint32_t doubt = 12;   ///< no coordinate is wrong by more, in units of 2^-22 cells
  static constexpr float order_doubt = 7e-6F;  ///< nor is the order of two crossings, in cells
  static constexpr std::uint8_t marked = 0xff;

  std::uint8_t* planes = nullptr;
  std::uint8_t* layers = nullptr;
  std::size_t size = 0;     ///< cells of a map
  std::size_t stride = 0;   ///< from map to map; what lies between is for rays that are not there
  unsigned log2_width = 0;  ///< of a map, in tiles, u being the fast axis
  std::int32_t low_u = 0;   ///< the map's first cell
  std::int32_t low_v = 0;
  std::int32_t first = 0;  ///< number of the first plane; 0 is where the rays start, and nothing is to be done there
  std::int32_t count = 0;  ///< planes

  /// The number of the cell (u, v).
  [[nodiscard]] std::uint32_t cell(std::int32_t u, std::int32_t v) const noexcept {
    return at(static_cast<std::uint32_t>(u - low_u), static_cast<std::uint32_t>(v - low_v));
  }
  /// The number of a cell whose u and v are counted from the map's first cell.
  [[nodiscard]] std::uint32_t at(std::uint32_t u, std::uint32_t v) const noexcept {
    return ((v >> 3U << log2_width | u >> 3U) << 6U) | (v & 7U) << 3U | (u & 7U);
  }
};

}  // namespace orbis::octree::detail

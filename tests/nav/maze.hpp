// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Small maps with boxes of obstacles, and the exact test of whether a ball is free.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include <orbis/core/random.hpp>
#include <orbis/core/types.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/occupancy_octree.hpp>
#include <orbis/octree/overlap.hpp>

namespace orbis::test {

using map_type = octree::occupancy_octree<>;

inline constexpr double cell = 0.1;  ///< edge of a voxel, metres

inline octree::voxel_key key(int x, int y, int z) {
  const auto along = [](int c) { return static_cast<std::uint32_t>(c + 32768); };
  return {along(x), along(y), along(z)};
}
inline void set(map_type& map, int x, int y, int z, bool occupied) {
  map.edit_octant(key(x, y, z), [&](octree::block<float>& b) {
    const auto i = octree::morton_code(key(x, y, z)) & 63U;
    b.known |= std::uint64_t{1} << i;
    b.value[i] = occupied ? 1.0F : -1.0F;
  });
}
/// Free space of `size` voxels from the origin on, with boxes of obstacles in it; of a share of it nothing is known.
inline map_type maze(random_bits& random, std::array<int, 3> size, int boxes, double unknown = 0.0) {
  map_type map{cell};
  for (int z = 0; z != size[2]; ++z)
    for (int y = 0; y != size[1]; ++y)
      for (int x = 0; x != size[0]; ++x)
        if (unknown == 0.0 || random.uniform() >= unknown) set(map, x, y, z, false);
  const auto below = [&](int n) { return static_cast<int>(random.below(static_cast<std::uint32_t>(n))); };
  for (int i = 0; i != boxes; ++i) {
    std::array<int, 3> low{}, high{};
    for (std::size_t j = 0; j != 3; ++j) {
      low[j] = below(size[j]);
      high[j] = std::min(size[j], low[j] + 1 + below(4));
    }
    for (int z = low[2]; z < high[2]; ++z)
      for (int y = low[1]; y < high[1]; ++y)
        for (int x = low[0]; x < high[0]; ++x) set(map, x, y, z, true);
  }
  return map;
}
inline vec3 random_point(random_bits& random, std::array<int, 3> size) {
  return {cell * size[0] * random.uniform(), cell * size[1] * random.uniform(), cell * size[2] * random.uniform()};
}
inline bool is_free(const map_type& map, const vec3& a, const vec3& b, double radius, octree::occupancy unknown) {
  return !overlaps(map, octree::capsule{a, b, radius}, {.unknown = unknown});
}

}  // namespace orbis::test

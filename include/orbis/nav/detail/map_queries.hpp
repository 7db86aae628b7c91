// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Single voxels and shapes in any map that planning reads: by what its `map_access` has for that, else by octants.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <utility>

#include <orbis/core/types.hpp>
#include <orbis/nav/map_access.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/octants.hpp>
#include <orbis/octree/overlap.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::nav::detail {

/// What is known of a voxel. @pre in the grid
template <planning_map Map>
[[nodiscard]] octree::occupancy state_of(const Map& map, const octree::voxel_key& k) {
  if constexpr (requires { map_access<Map>::state(map, k); }) {
    return map_access<Map>::state(map, k);
  } else {
    const octree::octant_states states = map_access<Map>::octants(map)(k);
    const std::uint64_t voxel = std::uint64_t{1} << (octree::morton_code(k) & 63U);
    if ((states.known & voxel) == 0) return octree::occupancy::unknown;
    return (states.occupied & voxel) != 0 ? octree::occupancy::occupied : octree::occupancy::free;
  }
}

/// The search of `octants_overlap`.
template <class Octants, octree::overlap_shape Shape>
class octant_overlap_search {
 public:
  octant_overlap_search(const octree::voxel_grid& grid, Octants octants, const Shape& shape, bool unknown_blocks)
      : grid_{grid}, octants_{std::move(octants)}, shape_{shape}, unknown_blocks_{unknown_blocks} {}

  [[nodiscard]] bool run() {
    const octree::bounding_box bounds = bounds_of(shape_);
    const double edge = grid_.resolution() * (grid_.cells() / 2);
    const bool is_inside = smallest_of(bounds.min) >= -edge && largest_of(bounds.max) <= edge;
    if (unknown_blocks_ && !is_inside) return true;
    // Faces that only touch are found as well.
    const auto keys =
        octree::keys_between(grid_, shifted(bounds.min, -grid_.resolution()), shifted(bounds.max, grid_.resolution()));
    if (!keys) return false;
    const std::uint32_t differ =
        (keys->low.x ^ keys->high.x) | (keys->low.y ^ keys->high.y) | (keys->low.z ^ keys->high.z);
    const int level = std::max(octant_level, static_cast<int>(std::bit_width(differ)));
    return is_met(*keys, octree::node_key(keys->low, level), level);
  }

 private:
  static constexpr int octant_level = 2;

  [[nodiscard]] bool touches_cube(const octree::voxel_key& k, int level) const {
    return touches(shape_, octree::cube_of(grid_, k, level));
  }
  [[nodiscard]] bool is_met(const octree::key_box& keys, const octree::voxel_key& k, int level) {
    if (!keys.overlaps(k, level) || !touches_cube(k, level)) return false;
    if (level == octant_level) return is_met_in(k);
    for (unsigned i = 0; i != 8; ++i)
      if (is_met(keys, octree::child_key(k, i, octree::node_cells(level - 1)), level - 1)) return true;
    return false;
  }
  [[nodiscard]] bool is_met_in(const octree::voxel_key& octant) {
    const octree::octant_states states = octants_(octant);
    std::uint64_t blocking = unknown_blocks_ ? ~states.free() : states.occupied;
    if (blocking == ~std::uint64_t{0}) return true;
    for (; blocking != 0; blocking &= blocking - 1) {
      const octree::voxel_key in = octree::morton_key(static_cast<std::uint64_t>(std::countr_zero(blocking)));
      if (touches_cube({octant.x + in.x, octant.y + in.y, octant.z + in.z}, 0)) return true;
    }
    return false;
  }

  octree::voxel_grid grid_;
  Octants octants_;
  const Shape& shape_;
  bool unknown_blocks_;
};

/// octree::overlaps by the octants of a map. O(octants that the shape touches).
template <planning_map Map, octree::overlap_shape Shape>
[[nodiscard]] bool octants_overlap(const Map& map, const Shape& shape, const octree::overlap_options& options) {
  const bool unknown_blocks = options.unknown == octree::occupancy::occupied;
  return octant_overlap_search{map_access<Map>::grid(map), map_access<Map>::octants(map), shape, unknown_blocks}.run();
}
/// octree::overlaps for any map. @pre finite coordinates
template <planning_map Map, octree::overlap_shape Shape>
[[nodiscard]] bool map_overlaps(const Map& map, const Shape& shape, const octree::overlap_options& options) {
  if constexpr (requires { map_access<Map>::overlaps(map, shape, options); })
    return map_access<Map>::overlaps(map, shape, options);
  else
    return octants_overlap(map, shape, options);
}

}  // namespace orbis::nav::detail

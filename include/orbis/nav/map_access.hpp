// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Read access to an occupancy map for planning: an octree, a snapshot of it, or a user-defined type with a trait.
#pragma once

#include <concepts>

#include <orbis/octree/accessor.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/octants.hpp>
#include <orbis/octree/overlap.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::nav {

/// Access to a map for planning. To support a user-defined type, specialise this template with `grid`, `octants` and
/// `for_each_octant` as in the specialisation for octrees below; the map is not copied. The other functions are
/// optional; without them, `state` and `overlaps` are implemented with `octants`, and octants in a box are selected
/// from all octants, which is slower.
template <class Map>
struct map_access;

/// Access to the octrees of orbis.
template <octree::octree_map Map>
struct map_access<Map> {
  /// The voxel grid.
  [[nodiscard]] static const octree::voxel_grid& grid(const Map& map) noexcept { return map.grid(); }
  /// A function object that returns the states of the octant of 4x4x4 voxels that contains a given voxel. Valid until
  /// the map changes.
  [[nodiscard]] static octree::octant_reader<Map> octants(const Map& map) { return octree::octant_reader<Map>{map}; }
  /// Calls `visit(lowest voxel, level, states)` for every octant (level 2) with known voxels; larger cubes whose
  /// octants all have the same states may be visited as one. Visits each voxel once, in any order.
  template <class Visit>
  static void for_each_octant(const Map& map, Visit&& visit) {
    octree::for_each_octant(map, visit);
  }
  /// Like the overload above, for octants that have a voxel in a box.
  template <class Visit>
  static void for_each_octant(const Map& map, const octree::key_box& box, Visit&& visit) {
    octree::for_each_octant(map, box, visit);
  }
  /// State of a voxel.
  [[nodiscard]] static octree::occupancy state(const Map& map, const octree::voxel_key& k) {
    const auto v = map.store().value(k);
    if (!v) return octree::occupancy::unknown;
    return octree::is_occupied<typename Map::model>(*v) ? octree::occupancy::occupied : octree::occupancy::free;
  }
  /// See octree::overlaps. @pre finite coordinates
  template <octree::overlap_shape Shape>
  [[nodiscard]] static bool overlaps(const Map& map, const Shape& shape, const octree::overlap_options& options) {
    return octree::overlaps(map, shape, options);
  }
};

/// A map for planning: a type with a `map_access`.
template <class Map>
concept planning_map = requires(const Map& map, const octree::voxel_key& k,
                                void (*visit)(const octree::voxel_key&, int, const octree::octant_states&)) {
  { map_access<Map>::grid(map) } -> std::convertible_to<const octree::voxel_grid&>;
  { map_access<Map>::octants(map)(k) } -> std::same_as<octree::octant_states>;
  map_access<Map>::for_each_octant(map, visit);
};

}  // namespace orbis::nav

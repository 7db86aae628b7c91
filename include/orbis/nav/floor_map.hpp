// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Where a robot that drives on the floor can go: a two-dimensional map made of an occupancy map.
///
/// @code
///   const orbis::nav::ground_robot robot{.radius = 0.2, .height = 0.6, .step = 0.05};
///   const auto floor = orbis::nav::make_floor_map(map, robot);
///   if (floor && floor->state(p) == orbis::nav::floor_state::free) ...
/// @endcode
///
/// The world is upright: z points up, against gravity. The library orbis::compiled holds the functions for
/// octree::occupancy_octree<>; users of other maps include floor_map-inl.hpp.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include <orbis/core/image.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>
#include <orbis/nav/map_access.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::nav {

/// What a robot takes: a vertical cylinder that drives.
struct ground_robot {
  double radius = 0.2;      ///< metres
  double height = 0.5;      ///< so much space it needs above the floor, metres
  double step = 0.05;       ///< the highest step it drives up or down, metres; less than a voxel: none
  double max_slope = 0.35;  ///< the steepest floor it drives on, radians
};

/// What is known of a cell of the floor.
enum class floor_state : std::uint8_t {
  unknown,
  free,     ///< the robot's middle may be over it, as far as this cell is concerned
  occupied  ///< an obstacle, a drop, a hole, too high a step, too steep, or too low under something
};

struct floor_map_options {
  std::optional<double> floor{};  ///< height of the floor, metres; empty: that of find_floor
  double below = 1.0;             ///< how far beneath the floor ramps and stairs are followed, metres
  double above = 1.0;             ///< how far above it
  /// What a cell counts as of which too little is known: unknown, free or occupied.
  octree::occupancy unknown = octree::occupancy::unknown;
  std::optional<octree::bounding_box> region{};  ///< which part of the map to look at (x and y), metres; empty: all
};

/// The floor by square cells, one for each column of voxels. Cell (0, 0) has the least x and y.
struct floor_map {
  double resolution = 0.0;      ///< the edge of a cell, metres
  vec2 origin = zeros<vec2>();  ///< the low corner of cell (0, 0), metres
  double floor = 0.0;           ///< height of the floor that was looked from, metres; see find_floor
  image<floor_state> states{};
  image<float> heights{};  ///< of the floor, metres; NaN where the robot does not get to

  /// The middle of a cell, metres.
  [[nodiscard]] vec2 center(int x, int y) const noexcept { return origin + resolution * vec2{x + 0.5, y + 0.5}; }
  /// The cell that contains `p` (metres; more than two coordinates are ignored); empty outside of the map.
  template <class P>
  [[nodiscard]] std::optional<std::array<int, 2>> cell(const P& p) const noexcept {
    const double x = (static_cast<double>(p[0]) - origin.x()) / resolution;
    const double y = (static_cast<double>(p[1]) - origin.y()) / resolution;
    if (!(x >= 0.0 && y >= 0.0 && x < states.width() && y < states.height())) return std::nullopt;
    return std::array{static_cast<int>(x), static_cast<int>(y)};
  }
  /// What is known at `p`; unknown outside of the map.
  template <class P>
  [[nodiscard]] floor_state state(const P& p) const noexcept {
    const auto at = cell(p);
    return at ? states((*at)[0], (*at)[1]) : floor_state::unknown;
  }
};

/// The height (metres) of the floor: the top of the lowest of the large horizontal layers, those that have at least
/// half as much surface with free space right above it as the largest has. Two layers of voxels count as one, for a
/// floor lies between them. What was seen of it lies in these voxels: up to one lower. Empty if there is no such
/// surface. O(octants + tops of larger leaves in octants; of these not more than 2^24 count).
template <planning_map Map>
[[nodiscard]] std::optional<double> find_floor(const Map& map);

/// The floor map of `map` for a robot.
///
/// A voxel is a *surface* if it is occupied and the robot's height above it is not. The robot gets to surfaces within a
/// step of the floor, and from each to those of the four neighbour columns that differ by a step at most: up ramps,
/// over thresholds, under tables. Of several that it gets to in one column (a bridge and what is under it), the lowest
/// counts. Such a cell is free, except that it is occupied
/// - if a neighbour is lower by more than a step: a drop,
/// - if the floor within the robot's radius (a square) rises by more than a step, and the plane through it is steeper
///   than `max_slope`. Cells that differ by more than a step for each cell that they are away do not count in this.
/// and that it is as `options.unknown` says if not all of the robot's height above it is known. A cell that the robot
/// does not get to is judged from the nearest one that it gets to: occupied if something stands in the robot's way
/// there, or if there is nothing to stand on (a hole: all within a step below is known to be free); else it is as
/// `options.unknown` says. With `occupied`, surfaces whose height above is not all known are not driven on at all.
///
/// After: A. Hornung et al., "OctoMap", Autonomous Robots 34, 2013 (projection of a height band); P. Fankhauser et al.,
/// "Probabilistic terrain mapping for mobile robots with uncertain localization", RA-L 3, 2018 (steps and slopes).
///
/// Errors: no_data (no floor is found, or nothing is known at its height), invalid_argument (more than 2^26 cells, each
/// taken once for each 64 voxels of known height in the layer: name a region, or look less far below and above). It
/// takes 16 bytes for each of these, and about 40 for each cell. O(octants + cells x (height of the layer +
/// (radius / resolution)^2 where it is not level)).
/// @pre height, radius > 0; step, below, above >= 0; 0 <= max_slope < pi / 2
template <planning_map Map>
[[nodiscard]] result<floor_map> make_floor_map(const Map& map, const ground_robot& robot = {},
                                               const floor_map_options& options = {});

}  // namespace orbis::nav

#ifndef ORBIS_COMPILED
#include <orbis/nav/floor_map-inl.hpp>
#endif

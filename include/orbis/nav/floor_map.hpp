// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A two-dimensional map of the area that a ground robot can drive on, made from an occupancy map.
///
/// @code
///   const orbis::nav::ground_robot robot{.radius = 0.2, .height = 0.6, .step = 0.05};
///   const auto floor = orbis::nav::make_floor_map(map, robot);
///   if (floor && floor->state(p) == orbis::nav::floor_state::free) ...
/// @endcode
///
/// The world is upright: z points up, against gravity. The library orbis::compiled contains the functions for
/// octree::occupancy_octree<>; for other map types, include floor_map-inl.hpp.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include <orbis/core/image.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>
#include <orbis/nav/map_access.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::nav {

/// A ground robot, modelled as a vertical cylinder.
struct ground_robot {
  double radius = 0.2;      ///< metres
  double height = 0.5;      ///< clearance that it needs above the floor, metres
  double step = 0.05;       ///< the highest step that it can drive up or down, metres; none if less than a voxel
  double max_slope = 0.35;  ///< the steepest floor that it can drive on, radians
};

/// State of a floor cell.
enum class floor_state : std::uint8_t {
  unknown,
  free,     ///< the robot's centre may be above it, considering only this cell
  occupied  ///< an obstacle, a drop, a hole, a step too high, a floor too steep, or too little clearance
};

struct floor_map_options {
  std::optional<double> floor{};  ///< height of the floor, metres; empty: the result of find_floor
  double below = 1.0;             ///< ramps and stairs are followed to this depth below the floor, metres
  double above = 1.0;             ///< ramps and stairs are followed to this height above the floor, metres
  /// State assigned to a cell if too little is known about it: unknown, free or occupied.
  octree::occupancy unknown = octree::occupancy::unknown;
  std::optional<octree::bounding_box> region{};  ///< part of the map to use (x and y), metres; empty: all
};

/// The floor as a grid of square cells, one for each column of voxels. Cell (0, 0) has the smallest x and y.
struct floor_map {
  double resolution = 0.0;      ///< edge length of a cell, metres
  vec2 origin = zeros<vec2>();  ///< the low corner of cell (0, 0), metres
  double floor = 0.0;           ///< height of the floor where the search began, metres; see find_floor
  image<floor_state> states{};
  image<float> heights{};  ///< height of the floor, metres; NaN where the robot cannot go

  /// The centre of a cell, metres.
  [[nodiscard]] vec2 center(int x, int y) const noexcept { return origin + resolution * vec2{x + 0.5, y + 0.5}; }
  /// The cell that contains `p` (metres; more than two coordinates are ignored); empty outside the map.
  template <class P>
  [[nodiscard]] std::optional<std::array<int, 2>> cell(const P& p) const noexcept {
    const double x = (static_cast<double>(p[0]) - origin.x()) / resolution;
    const double y = (static_cast<double>(p[1]) - origin.y()) / resolution;
    if (!(x >= 0.0 && y >= 0.0 && x < states.width() && y < states.height())) return std::nullopt;
    return std::array{static_cast<int>(x), static_cast<int>(y)};
  }
  /// State at `p`; unknown outside the map.
  template <class P>
  [[nodiscard]] floor_state state(const P& p) const noexcept {
    const auto at = cell(p);
    return at ? states((*at)[0], (*at)[1]) : floor_state::unknown;
  }
};

/// Height (metres) of the floor: the top of the lowest large horizontal layer. A layer is large if its surface with
/// free space directly above it is at least half that of the largest layer. Two adjacent voxel layers count as one,
/// because a floor may lie between them. The true floor is inside the voxels of the layer, so it is up to one voxel
/// lower than the result. Empty if there is no such surface. O(octants + octants on top of larger leaves, at most 2^24
/// of which are examined).
template <planning_map Map>
[[nodiscard]] std::optional<double> find_floor(const Map& map);

/// Makes the floor map of `map` for a robot.
///
/// A voxel is a *surface* if it is occupied and no voxel within the robot's height above it is. The robot reaches
/// surfaces within a step of the floor and, from each reached surface, surfaces in the four neighbouring columns that
/// differ by at most a step: up ramps, over thresholds, under tables. If it reaches several surfaces in one column (a
/// bridge and the ground under it), the lowest counts. The cell of a reached surface is free, with these exceptions:
/// - It is occupied if a neighbour is lower by more than a step (a drop).
/// - It is occupied if the floor within the robot's radius (a square) rises by more than a step, and the plane through
///   it is steeper than `max_slope`. Cells that differ by more than a step per cell of distance are ignored here.
/// - It has the state `options.unknown` if the space above it, up to the robot's height, is not fully known.
///
/// A cell that the robot does not reach is classified relative to the nearest reached cell: occupied if an obstacle is
/// in the robot's way, or if there is nothing to drive on (a hole: all voxels within a step below are known to be
/// free); otherwise it has the state `options.unknown`. If `options.unknown` is `occupied`, the robot does not drive on
/// surfaces below space that is not fully known.
///
/// After: A. Hornung et al., "OctoMap", Autonomous Robots 34, 2013 (projection of a height band); P. Fankhauser et al.,
/// "Probabilistic terrain mapping for mobile robots with uncertain localization", RA-L 3, 2018 (steps and slopes).
///
/// Errors: no_data (no floor is found, nothing is known at its height, or the floor or the region is outside the grid),
/// invalid_argument (the region's `min` exceeds its `max`, or the columns of the known part of the layer take more than
/// 2^26 words of 64 voxels each: pass a smaller region, or reduce `below` and `above`). Uses 16 bytes per word, and
/// about 40 bytes per cell. O(octants + cells x (height of the layer + (radius / resolution)^2 where it is not level)).
/// @pre height, radius > 0; step, below, above >= 0; 0 <= max_slope < pi / 2
template <planning_map Map>
[[nodiscard]] result<floor_map> make_floor_map(const Map& map, const ground_robot& robot = {},
                                               const floor_map_options& options = {});

}  // namespace orbis::nav

#ifndef ORBIS_COMPILED
#include <orbis/nav/floor_map-inl.hpp>
#endif

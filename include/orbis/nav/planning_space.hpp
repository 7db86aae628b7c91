// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a path is searched in: places on a regular grid, and straight ways that a robot can go or not.
#pragma once

#include <concepts>
#include <optional>

#include <orbis/core/types.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::nav {

/// What going costs beside its length, and where one may go at all. A way costs the integral of the density along it
/// (metres), in which a cell's density is
///
///     (1 + clearance_weight (1 - d / preferred_clearance)^2) u,    d < preferred_clearance
///
/// with d the distance of the robot's hull to the nearest obstacle when the robot stands in the middle of the cell
/// (metres, to about a cell), the bracket 1 for greater d, and u = `unknown_cost` where nothing is known of the cell,
/// else 1. No way costs less than its length.
struct planning_options {
  /// The robot's reference point stays in this box, metres; empty: anywhere on the grid.
  std::optional<octree::bounding_box> region{};
  double clearance_weight = 0.0;     ///< >= 0; 0: only the length counts
  double preferred_clearance = 0.3;  ///< metres; > 0. The field should reach so much beyond the robot
  /// Of a metre through what is unknown, where that counts as free; >= 1.
  double unknown_cost = 1.0;
};

/// Where a path can be searched: `planning_view` in space, `floor_view` on the floor. Positions are in metres; cells
/// have keys, of which floors leave z at 0.
///
/// - `dimensions`: 2 or 3, the axes along which cells have neighbours;
/// - `resolution()`: the edge of a cell, metres;
/// - `key(p)`: the cell of a position; empty outside of the grid and of the region, and if not finite;
/// - `contains(k)`: whether a cell is in the grid, and its middle in the region;
/// - `center(k)`: its middle;
/// - `clamped(p)`: the point of the grid nearest to `p`, which is finite (where the search for a goal outside heads);
/// - `is_free(k)`, `is_free(p)`, `is_free(a, b)`: whether the robot fits in the middle of a cell, at a position, and
///   everywhere on the straight way between two positions. The last one is the first where both ends are the same;
/// - `is_surely_free(a, b)`: a test for the same that costs little, and may be false where the way is free;
/// - `density(k)`: what a metre costs in a cell, at least 1; `is_uniform()`: whether it is 1 everywhere;
/// - `placed(p)`: the position as it is searched for: on a floor with z = 0;
/// - `on_ground(p)`: the position as it is reported: with the floor's height, where there is a floor.
template <class S>
concept planning_space = requires(const S& space, const vec3& p, const octree::voxel_key& k) {
  requires S::dimensions == 2 || S::dimensions == 3;
  { space.resolution() } -> std::convertible_to<double>;
  { space.key(p) } -> std::same_as<std::optional<octree::voxel_key>>;
  { space.contains(k) } -> std::same_as<bool>;
  { space.center(k) } -> std::convertible_to<vec3>;
  { space.clamped(p) } -> std::convertible_to<vec3>;
  { space.is_free(k) } -> std::same_as<bool>;
  { space.is_free(p) } -> std::same_as<bool>;
  { space.is_free(p, p) } -> std::same_as<bool>;
  { space.is_surely_free(p, p) } -> std::same_as<bool>;
  { space.density(k) } -> std::convertible_to<double>;
  { space.is_uniform() } -> std::same_as<bool>;
  { space.placed(p) } -> std::convertible_to<vec3>;
  { space.on_ground(p) } -> std::convertible_to<vec3>;
};

/// A planning space that says of thicker robots, too, whether they fit: what make_trajectory needs.
///
/// - `is_free(a, b, by)`: true only if nothing that is within `by` (metres, >= 0) of what the robot sweeps on its
/// straight
///   way from `a` to `b` is an obstacle, and both ends are in the space.
template <class S>
concept inflatable_space = planning_space<S> && requires(const S& space, const vec3& p, double by) {
  { space.is_free(p, p, by) } -> std::same_as<bool>;
};

}  // namespace orbis::nav

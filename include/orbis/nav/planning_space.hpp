// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The space of a path search: positions on a regular grid, and straight segments that are free or blocked.
#pragma once

#include <concepts>
#include <optional>

#include <orbis/core/types.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::nav {

/// Options for the cost of paths, and the region of the search. A path costs the integral of the density along it
/// (metres). The density of a cell is
///
///     (1 + clearance_weight (1 - d / preferred_clearance)^2) u,    d < preferred_clearance
///
/// where d is the distance from the robot's hull to the nearest obstacle when the robot is at the centre of the cell
/// (metres, accurate to about a cell); the factor in parentheses is 1 for greater d, and u is `unknown_cost` in unknown
/// cells and 1 elsewhere. No path costs less than its length.
struct planning_options {
  /// Box in which the robot's reference point must stay, metres; empty: anywhere on the grid.
  std::optional<octree::bounding_box> region{};
  double clearance_weight = 0.0;     ///< >= 0; 0: length only
  double preferred_clearance = 0.3;  ///< metres; > 0. The field's reach should be at least the radius plus this
  /// Cost per metre through unknown space, if unknown space counts as free; >= 1.
  double unknown_cost = 1.0;
};

/// The space of a path search: `planning_view` in three dimensions, `floor_view` on a floor. Positions are in metres;
/// cells have keys, with z = 0 on floors.
///
/// - `dimensions`: 2 or 3, the axes along which cells have neighbours;
/// - `resolution()`: edge length of a cell, metres;
/// - `key(p)`: the cell of a position; empty if the position is outside the grid or the region, or not finite;
/// - `contains(k)`: whether a cell is in the grid and its centre in the region;
/// - `center(k)`: the centre of a cell;
/// - `clamped(p)`: the point of the grid nearest to the finite position `p` (the target of the search if the goal is
///   outside);
/// - `is_free(k)`, `is_free(p)`, `is_free(a, b)`: whether the robot fits at the centre of a cell, at a position, and
///   everywhere on the straight segment between two positions. If both ends are equal, the last overload equals
///   `is_free(p)`;
/// - `is_surely_free(a, b)`: a cheap, conservative version of `is_free(a, b)`; it may return false for a free segment;
/// - `density(k)`: the cost per metre in a cell, at least 1; `is_uniform()`: whether it is 1 everywhere;
/// - `placed(p)`: the position as used in the search; on a floor, with z = 0;
/// - `on_ground(p)`: the position as reported; on a floor, at the floor's height.
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

/// A planning space that also tests inflated robots, as required by make_trajectory.
///
/// - `is_free(a, b, by)`: true only if no obstacle is within `by` (metres, >= 0) of the volume that the robot sweeps on
///   the straight segment from `a` to `b`, and both ends are in the space.
template <class S>
concept inflatable_space = planning_space<S> && requires(const S& space, const vec3& p, double by) {
  { space.is_free(p, p, by) } -> std::same_as<bool>;
};

}  // namespace orbis::nav

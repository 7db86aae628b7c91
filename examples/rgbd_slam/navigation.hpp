// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Navigation in the map of a run: the area in which a robot can drive, and a path through the room.
#pragma once

#include <algorithm>
#include <filesystem>

#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/octree/occupancy_octree.hpp>

#include "console.hpp"
#include "results.hpp"
#include "settings.hpp"

namespace app {

/// The maximum distance of the distance field in metres, sufficient for the robot and the picture, within the limits of
/// the field.
[[nodiscard]] inline double field_reach(double robot_radius, double resolution) {
  return std::min(std::max(1.0, robot_radius + 2 * resolution), 181 * resolution);
}

/// Computes the floor map and plans a path between two places that the camera saw: on the floor or, without a floor,
/// through the air for a ball-shaped flying robot. If `s.floor_map` is set, writes the floor map to `floor_file`;
/// messages use `s.floor_map`, its final path. Draws navigation.png into `folder` if there is a floor or at least one
/// camera pose. Errors: write_failed (the picture); for the floor map see `navigation_results::unsaved`.
[[nodiscard]] orbis::result<navigation_results> navigate(const orbis::octree::occupancy_octree<>& map,
                                                         const orbis::trajectory& cameras, const settings& s,
                                                         const std::filesystem::path& folder,
                                                         const std::filesystem::path& floor_file, console& console);

}  // namespace app

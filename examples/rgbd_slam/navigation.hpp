// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a robot can do with the map of a run: where it can drive, and a way through the room.
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

/// The reach of the distance field in metres, for a robot and for a picture, within the limits of the field.
[[nodiscard]] inline double field_reach(double robot_radius, double resolution) {
  return std::min(std::max(1.0, robot_radius + 2 * resolution), 181 * resolution);
}

/// Makes the floor map; writes it to `floor_file` if `s.floor_map` (its final path, used in messages) is given; plans a
/// path between two places that the camera saw, on the floor or otherwise for a ball through the air; and draws
/// navigation.png into `folder`. There is no picture without a floor and a camera. Errors: write_failed (the picture);
/// for the floor map see `navigation_results::unsaved`.
[[nodiscard]] orbis::result<navigation_results> navigate(const orbis::octree::occupancy_octree<>& map,
                                                         const orbis::trajectory& cameras, const settings& s,
                                                         const std::filesystem::path& folder,
                                                         const std::filesystem::path& floor_file, console& console);

}  // namespace app

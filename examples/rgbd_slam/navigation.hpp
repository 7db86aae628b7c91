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

/// How far a distance field is to reach for a robot and for a picture, as far as one can, metres.
[[nodiscard]] inline double field_reach(double robot_radius, double resolution) {
  return std::min(std::max(1.0, robot_radius + 2 * resolution), 181 * resolution);
}

/// Makes the floor map, writes it to `floor_file` if `s.floor_map` is given (where it will be, which messages name),
/// plans a path between two places that the camera saw, on the floor or else of a ball through the air, and draws
/// navigation.png into `folder`. No picture where there is neither a floor nor a camera. Errors: write_failed, of the
/// picture; for the floor map see `navigation_results::unsaved`.
[[nodiscard]] orbis::result<navigation_results> navigate(const orbis::octree::occupancy_octree<>& map,
                                                         const orbis::trajectory& cameras, const settings& s,
                                                         const std::filesystem::path& folder,
                                                         const std::filesystem::path& floor_file, console& console);

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A picture from above of the floor map with its costs, or of a slice of the distance field, with a path.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>
#include <orbis/nav/distance_field.hpp>
#include <orbis/nav/floor_map.hpp>
#include <orbis/octree/occupancy_octree.hpp>

namespace app {

struct navigation_picture {
  std::string title, subtitle;
  const orbis::octree::occupancy_octree<>& map;
  const orbis::nav::distance_field* field = nullptr;  ///< null: no slice
  double height = 0.0;                                ///< height of the slice, metres
  const orbis::nav::floor_map* floor = nullptr;       ///< null: no floor is drawn
  double radius = 0.2;                                ///< radius of the robot, metres
  std::vector<orbis::vec3> path{};  ///< world, metres; drawn over the slice, or over the floor if there is no slice
  bool drives = false;              ///< the path is drawn over the floor
};

/// Writes the picture as a PNG file. Coordinates are in the world frame. Errors: write_failed.
[[nodiscard]] orbis::result<void> write_navigation_picture(const navigation_picture& what,
                                                           const std::filesystem::path& path);

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Mapping: from posed frames or a cloud to a filtered cloud and an octree, and their files.
#pragma once

#include <optional>

#include <orbis/camera/any.hpp>
#include <orbis/mapping/batch.hpp>
#include <orbis/mapping/live_map.hpp>

#include "console.hpp"
#include "keyframe_depths.hpp"
#include "posed_frames.hpp"
#include "results.hpp"
#include "settings.hpp"

namespace app {

using built_map = orbis::mapping::built_map<orbis::octree::occupancy_octree<>>;
using live_octree = orbis::mapping::live_map<orbis::octree::occupancy_octree<>, orbis::camera::any_camera, live_depths>;

/// The selection of pixels that become points, and the density of the cloud.
[[nodiscard]] orbis::mapping::dense_options dense_options(const frame_source& source, const settings& s);
/// Builds the map of a run: keyframes -> dense cloud -> filter -> octree. Uses the live map if `live` is not null.
[[nodiscard]] orbis::result<built_map> map_frames(const posed_frames& frames, const frame_source& source,
                                                  live_octree* live, const settings& s, console& console);
/// Builds the map of a cloud: cloud -> filter -> octree. With an origin, rays from the origin to the points are
/// inserted; without one, the voxels of the points are occupied and all others are unknown.
[[nodiscard]] built_map map_cloud(orbis::point_cloud cloud, const settings& s, console& console);

/// Writes the clouds and octrees into `folder` and returns their statistics.
[[nodiscard]] orbis::result<map_results> write_map(built_map map, const settings& s,
                                                   const std::filesystem::path& folder, console& console);

}  // namespace app

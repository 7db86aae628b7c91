// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Everything in orbis::octree: the log-odds occupancy octree.
///
/// | header | what it is for |
/// | --- | --- |
/// | occupancy_octree.hpp | the map: insertion, queries, snapshots, rolling window |
/// | integration.hpp | options of an insertion, and what became of a scan's points |
/// | sensor_model.hpp | what a hit and a miss do to a voxel: OctoMap's model, or your own |
/// | key.hpp | voxel keys, the grid, boxes, Morton order |
/// | accessor.hpp | many look-ups near each other; the concept of a map |
/// | octants.hpp | what is known, as bit masks of 4x4x4 voxels |
/// | cast_ray.hpp | what a ray meets first, one ray or many |
/// | overlap.hpp | whether boxes, spheres and capsules are free |
/// | change_log.hpp | which voxels changed since a revision |
/// | scan_history.hpp | a map that follows its scans when they change, are removed or come late |
/// | scan_voxels.hpp | the voxels that one scan observes, packed; the marker that finds them |
/// | decay.hpp | what time does to voxels that are not observed |
/// | voxel_layer.hpp | colours, labels or counts beside the map |
/// | files.hpp | OctoMap's `.bt` and `.ot` |
/// | depth_points.hpp | world points of a depth image |
#pragma once

#include <orbis/octree/accessor.hpp>
#include <orbis/octree/cast_ray.hpp>
#include <orbis/octree/change_log.hpp>
#include <orbis/octree/decay.hpp>
#include <orbis/octree/depth_points.hpp>
#include <orbis/octree/files.hpp>
#include <orbis/octree/integration.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/occupancy_octree.hpp>
#include <orbis/octree/octants.hpp>
#include <orbis/octree/overlap.hpp>
#include <orbis/octree/scan_history.hpp>
#include <orbis/octree/scan_voxels.hpp>
#include <orbis/octree/sensor_model.hpp>
#include <orbis/octree/voxel_layer.hpp>

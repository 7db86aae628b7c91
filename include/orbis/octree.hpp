// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The log-odds occupancy octree.
///
/// | header | contents |
/// | --- | --- |
/// | occupancy_octree.hpp | the map: insertion, queries, snapshots, rolling window |
/// | integration.hpp | options and summary of an insertion |
/// | sensor_model.hpp | effect of a hit and a miss on a voxel: OctoMap's model, or a custom one |
/// | key.hpp | voxel keys, the grid, boxes, Morton order |
/// | accessor.hpp | fast look-up of voxels near each other; the map concept |
/// | octants.hpp | states of voxels, as bit masks of 4x4x4 voxels |
/// | cast_ray.hpp | ray casting, one ray or many |
/// | overlap.hpp | collision tests for boxes, spheres and capsules |
/// | change_log.hpp | log of voxels changed since a revision |
/// | scan_history.hpp | a map that is updated when its scans change, are removed or arrive late |
/// | scan.hpp | the voxels observed by one scan, packed; the marker that determines them |
/// | decay.hpp | decay of voxels that are not observed |
/// | voxel_layer.hpp | colours, labels or counts for the voxels of a map |
/// | files.hpp | reading and writing of OctoMap's `.bt` and `.ot` files |
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
#include <orbis/octree/scan.hpp>
#include <orbis/octree/scan_history.hpp>
#include <orbis/octree/sensor_model.hpp>
#include <orbis/octree/voxel_layer.hpp>

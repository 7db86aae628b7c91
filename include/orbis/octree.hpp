// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Everything in orbis::octree: the log-odds occupancy octree.
#pragma once

#include <orbis/octree/accessor.hpp>
#include <orbis/octree/annotate.hpp>
#include <orbis/octree/cast_ray.hpp>
#include <orbis/octree/change_log.hpp>
#include <orbis/octree/compact_file.hpp>
#include <orbis/octree/decay.hpp>
#include <orbis/octree/depth_points.hpp>
#include <orbis/octree/files.hpp>
#include <orbis/octree/integration.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/key_box.hpp>
#include <orbis/octree/leaves.hpp>
#include <orbis/octree/merge.hpp>
#include <orbis/octree/morton.hpp>
#include <orbis/octree/nodes.hpp>
#include <orbis/octree/occupancy_octree.hpp>
#include <orbis/octree/overlap.hpp>
#include <orbis/octree/render.hpp>
#include <orbis/octree/scan.hpp>
#include <orbis/octree/sensor_model.hpp>
#include <orbis/octree/subtract.hpp>
#include <orbis/octree/surface.hpp>
#include <orbis/octree/voxel_layer.hpp>
#include <orbis/octree/voxel_payload.hpp>

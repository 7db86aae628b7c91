// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Dense clouds, filtered clouds and octrees from keyframes.
///
/// | header | contents |
/// | --- | --- |
/// | `batch.hpp` | `build_map`: a map from posed keyframes in one batch |
/// | `live_map.hpp` | `live_map`: an octree that grows with each keyframe and is updated when keyframe poses change |
/// | `live_map_thread.hpp` | a live map with its own thread, a queue, and snapshots for readers |
/// | `live_map_events.hpp` | events and callbacks of a live map |
/// | `depth_history.hpp` | the concept for a store of the keyframes' depth images |
/// | `dense_cloud.hpp` | the points of all keyframes as one cloud, updated when keyframe poses change |
/// | `depth_store.hpp` | depth images of many keyframes, compressed without loss, within a memory budget |
/// | `filter.hpp` | `filter_points`: the outlier filter, selected at run time |
/// | `keyframe.hpp` | the keyframe type that mapping uses |
/// | `masked_depth.hpp` | depth images with removed pixels |
/// | `moving_filter.hpp` | removes moved objects from a live map while the camera moves |
/// | `moving_options.hpp` | thresholds for detecting moved objects |
/// | `moving_regions.hpp` | removes objects that tracking has detected as moving from a depth image |
/// | `keyframe_points.hpp` | the points of one keyframe |
/// | `upright.hpp` | the upward direction in a depth image, so that a map can begin upright |
#pragma once

#include <orbis/mapping/batch.hpp>
#include <orbis/mapping/dense_cloud.hpp>
#include <orbis/mapping/depth_history.hpp>
#include <orbis/mapping/depth_store.hpp>
#include <orbis/mapping/filter.hpp>
#include <orbis/mapping/keyframe.hpp>
#include <orbis/mapping/keyframe_points.hpp>
#include <orbis/mapping/live_map.hpp>
#include <orbis/mapping/live_map_events.hpp>
#include <orbis/mapping/live_map_thread.hpp>
#include <orbis/mapping/masked_depth.hpp>
#include <orbis/mapping/moving_filter.hpp>
#include <orbis/mapping/moving_options.hpp>
#include <orbis/mapping/moving_regions.hpp>
#include <orbis/mapping/upright.hpp>

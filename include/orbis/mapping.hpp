// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Mapping: keyframes to dense clouds, filtered clouds and octrees.
///
/// | header | what it is for |
/// | --- | --- |
/// | `batch.hpp` | `build_map`: from posed keyframes to a map, all at once |
/// | `live_map.hpp` | `live_map`: an octree that grows with each keyframe and follows corrections of their poses |
/// | `live_map_thread.hpp` | the same with a thread and a queue, and snapshots for readers |
/// | `live_map_events.hpp` | what it tells and asks |
/// | `depth_history.hpp` | the concept of what keeps the keyframes' depth images for it |
/// | `dense_cloud.hpp` | the points of all keyframes as one cloud, which follows corrections of their poses |
/// | `depth_store.hpp` | depth images of many keyframes, compressed without loss, within a budget |
/// | `filter.hpp` | `filter_points`: the outlier filter, as a choice at run time |
/// | `keyframe.hpp` | what mapping needs of a keyframe |
/// | `masked_depth.hpp` | depth images from which pixels were removed |
/// | `moving_filter.hpp` | takes out of a live map what has moved away, while the camera moves |
/// | `moving_options.hpp` | how what has moved away is told from what is there |
/// | `moving_regions.hpp` | takes out of a depth image what tracking has seen to move |
/// | `keyframe_points.hpp` | the points of one keyframe |
/// | `upright.hpp` | which way is up in a depth image, so that a map can begin upright |
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

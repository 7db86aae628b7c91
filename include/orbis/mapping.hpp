// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Mapping: keyframes to dense clouds, filtered clouds and octrees.
///
/// | header | what it is for |
/// | --- | --- |
/// | `batch.hpp` | `build_map`: from posed keyframes to a map, all at once |
/// | `dense_cloud.hpp` | the points of all keyframes as one cloud, which follows corrections of their poses |
/// | `depth_store.hpp` | depth images of many keyframes, compressed without loss, within a budget |
/// | `filter.hpp` | `filter_points`: the outlier filter, as a choice at run time |
/// | `keyframe.hpp` | what mapping needs of a keyframe |
/// | `keyframe_points.hpp` | the points of one keyframe |
#pragma once

#include <orbis/mapping/batch.hpp>
#include <orbis/mapping/dense_cloud.hpp>
#include <orbis/mapping/depth_store.hpp>
#include <orbis/mapping/filter.hpp>
#include <orbis/mapping/keyframe.hpp>
#include <orbis/mapping/keyframe_points.hpp>

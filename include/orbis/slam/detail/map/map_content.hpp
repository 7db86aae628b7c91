// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a map consists of.
#pragma once

#include <cstdint>
#include <map>

#include <orbis/core/se3.hpp>
#include <orbis/slam/detail/map/slot_map.hpp>
#include <orbis/slam/frame.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/landmark.hpp>
#include <orbis/slam/spanning_tree.hpp>

namespace orbis::slam::detail {

/// What is left of a keyframe that was erased: where it was, seen from the keyframe that took its place.
struct erased_keyframe {
  keyframe_id heir = no_id;  ///< erased itself, maybe; `no_id` if it was the last one
  se3 T_heir_camera;         ///< or `T_world_camera` without an heir
};

/// What a map consists of; all the rest of it follows.
struct map_content {
  int levels = 8;                 ///< of the image pyramid
  double scale_factor = 1.2;      ///< between two levels
  std::uint32_t min_shared = 15;  ///< landmarks that make an edge of the covisibility graph
  slot_map<keyframe> keyframes;
  slot_map<landmark> landmarks;
  spanning_tree tree;
  std::map<keyframe_id, erased_keyframe> erased;
};

}  // namespace orbis::slam::detail

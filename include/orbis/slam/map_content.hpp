// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a map consists of.
#pragma once

#include <cstdint>
#include <map>

#include <orbis/core/se3.hpp>
#include <orbis/slam/frame.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/landmark.hpp>
#include <orbis/slam/numbered.hpp>
#include <orbis/slam/spanning_tree.hpp>

namespace orbis::slam {

/// A frame that the map keeps. `landmarks` of the frame are its observations.
struct keyframe : frame {
  keyframe_id id = no_id;
};

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
  numbered<keyframe> keyframes;
  numbered<landmark> landmarks;
  spanning_tree tree;
  std::map<keyframe_id, erased_keyframe> erased;
};

/// What the numbers of another map have grown by, now that it is a part of this one.
struct id_offsets {
  keyframe_id keyframes = 0;
  landmark_id landmarks = 0;
};

/// Where one map is hung on another: a keyframe of each that show the same place.
struct map_link {
  keyframe_id into = no_id;  ///< of the map that stays
  keyframe_id from = no_id;  ///< of the one that becomes a part of it, in its own numbers
};

}  // namespace orbis::slam

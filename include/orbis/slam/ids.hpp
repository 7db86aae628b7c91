// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What names the keyframes and landmarks of a map.
#pragma once

#include <cstdint>
#include <limits>

namespace orbis::slam {

/// Landmarks and keyframes are numbered in the order of their creation; numbers are never used again.
using landmark_id = std::uint32_t;
using keyframe_id = std::uint32_t;
inline constexpr std::uint32_t no_id = std::numeric_limits<std::uint32_t>::max();

/// Maps are numbered in the order of their creation; numbers are never used again.
using map_id = std::uint32_t;

/// A keyframe of an atlas.
struct map_keyframe {
  map_id map = 0;
  keyframe_id keyframe = no_id;
  friend bool operator==(const map_keyframe&, const map_keyframe&) = default;
};

/// By how much the ids of a map have grown when it became a part of another one.
struct id_offsets {
  keyframe_id keyframes = 0;
  landmark_id landmarks = 0;
};

/// Where one map is attached to another: a keyframe of each that show the same place.
struct map_link {
  keyframe_id into = no_id;  ///< of the map that stays
  keyframe_id from = no_id;  ///< of the one that becomes a part of it, in its own ids
};

}  // namespace orbis::slam

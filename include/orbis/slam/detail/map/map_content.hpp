// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The data of a map, from which everything else in it follows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>

#include <orbis/core/se3.hpp>
#include <orbis/slam/detail/map/slot_map.hpp>
#include <orbis/slam/frame.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/landmark.hpp>
#include <orbis/slam/spanning_tree.hpp>

namespace orbis::slam::detail {

/// A rigid motion, with its translation multiplied.
[[nodiscard]] inline se3 scaled(const se3& T, double factor) { return {T.rotation(), vec3(factor * T.translation())}; }

/// Where an erased keyframe was, relative to the keyframe that replaced it.
struct erased_keyframe {
  keyframe_id replacement;   ///< may be erased itself; `no_id` if no keyframe was left
  se3 T_replacement_camera;  ///< in lengths over the replacement's `scale`; without a replacement: `T_world_camera`
  double scale = 1.0;        ///< over that of the replacement
  std::uint64_t number = 0;  ///< keyframes were erased in this order
};

/// How many ids later an erased landmark may be forgotten: who still asks for its replacement holds a frame, or what a
/// loop was found by, of the last seconds; in a hundred seconds a camera at 30 Hz makes so many landmarks.
inline constexpr std::uint32_t remembered_landmarks = 1U << 18U;

template <feature_descriptor D>
struct map_content {
  int levels = 8;                             ///< of the image pyramid
  double scale_factor = 1.2;                  ///< between two levels
  std::uint32_t min_shared = 15;              ///< shared landmarks that make an edge of the covisibility graph
  sensor_kind sensor = sensor_kind::unknown;  ///< of the first keyframe
  bool scale_is_known = true;                 ///< of the first keyframe
  slot_map<basic_keyframe<D>, keyframe_id> keyframes;
  slot_map<basic_landmark<D>, landmark_id, remembered_landmarks> landmarks;
  spanning_tree tree;
  std::map<keyframe_id, erased_keyframe> erased;  ///< those that were not forgotten
  std::uint64_t erasures = 0;                     ///< the numbers of all erased keyframes are less
  std::size_t forgotten = 0;                      ///< ids of keyframes that are neither there nor in `erased`
};

/// A map that gave more ids to landmarks is written without those of erased ones, so that it can go on when it is read.
inline constexpr std::uint32_t most_landmarks_of_file = 1U << 28U;
/// Ids of keyframes in a file: those of some years.
inline constexpr std::uint32_t most_keyframes_of_file = 1U << 28U;
/// In a file, before a keyframe: what follows.
inline constexpr std::uint8_t gone_keyframe = 0, kept_keyframe = 1, forgotten_keyframes = 2;
/// In a file, instead of a landmark's number of observations: a number of ids follows that are gone.
inline constexpr std::uint32_t run_of_gone = 0xffffffffU;

}  // namespace orbis::slam::detail

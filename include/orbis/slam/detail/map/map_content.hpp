// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The data of a map from which all its other data are derived.
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

/// Returns a rigid transform with its translation multiplied by `factor`.
[[nodiscard]] inline se3 scaled(const se3& T, double factor) { return {T.rotation(), vec3(factor * T.translation())}; }

/// The pose of an erased keyframe relative to its replacement.
struct erased_keyframe {
  keyframe_id replacement;   ///< may itself be erased; `no_id` if no keyframe was left
  se3 T_replacement_camera;  ///< translation divided by the replacement's `scale`; `T_world_camera` if none is left
  double scale = 1.0;        ///< scale of the keyframe relative to that of the replacement
  std::uint64_t number = 0;  ///< sequence number of the erasure
};

/// An erased landmark may be forgotten once this number of ids has been assigned after its erasure. Replacements are
/// queried only for frames and loop matches of the last few seconds; a 30 Hz camera creates this number of landmarks in
/// about a hundred seconds.
inline constexpr std::uint32_t remembered_landmarks = 1U << 18U;

template <feature_descriptor D>
struct map_content {
  int levels = 8;                 ///< number of levels of the image pyramid
  double scale_factor = 1.2;      ///< scale factor between two levels
  std::uint32_t min_shared = 15;  ///< minimum number of shared landmarks for an edge of the covisibility graph
  sensor_kind sensor = sensor_kind::unknown;  ///< sensor of the first keyframe
  bool scale_is_known = true;                 ///< taken from the first keyframe
  slot_map<basic_keyframe<D>, keyframe_id> keyframes;
  slot_map<basic_landmark<D>, landmark_id, remembered_landmarks> landmarks;
  spanning_tree tree;
  std::map<keyframe_id, erased_keyframe> erased;  ///< erased keyframes whose poses are still known
  std::uint64_t erasures = 0;  ///< number of erasures so far, greater than the sequence number of any erased keyframe
  std::size_t forgotten = 0;   ///< number of keyframe ids that neither exist nor are in `erased`
};

/// Maximum number of landmark ids in a file. A map with more ids is written without the erased ones, so that it can
/// grow after reading.
inline constexpr std::uint32_t most_landmarks_of_file = 1U << 28U;
/// Maximum number of keyframe ids in a file, enough for several years.
inline constexpr std::uint32_t most_keyframes_of_file = 1U << 28U;
/// State of a keyframe id in a file, stored before its data.
inline constexpr std::uint8_t gone_keyframe = 0, kept_keyframe = 1, forgotten_keyframes = 2;
/// Value that replaces a landmark's number of observations in a file if the length of a run of erased ids follows.
inline constexpr std::uint32_t run_of_gone = 0xffffffffU;

}  // namespace orbis::slam::detail

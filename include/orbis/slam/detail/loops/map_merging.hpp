// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Merging of two maps that observe the same place.
///
/// `take` and `join` access the maps; `loop_fusion::find_pairs` works on the snapshot. Both maps may grow between these
/// calls. Callers that share the maps lock them for `take`, `join` and each part of `loop_fusion::fuse`.
///
/// Source: C. Campos, R. Elvira, J. J. Gomez Rodriguez, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM3", T-RO 37 (2021),
/// section VI.
#pragma once

#include <optional>

#include <orbis/core/sim3.hpp>
#include <orbis/slam/atlas.hpp>
#include <orbis/slam/detail/loops/loop_fusion.hpp>
#include <orbis/slam/detail/loops/loop_verification.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail::map_merging {

/// The result of merging two maps.
struct report {
  bool merged = false;
  id_offsets offsets;     ///< offsets added to the ids of the merged map
  keyframe_id keyframe;   ///< keyframe of the match, with its new id
  keyframe_id candidate;  ///< candidate of the match
  sim3 T_into_from;       ///< transform applied to the merged map
};

template <feature_descriptor D>
struct snapshot {
  map_id from, into;
  loop_match match;
  loop_fusion::snapshot<D> fusion;
};

/// Returns true if the maps and keyframes of a match exist and enough ids are left for the merged map.
template <feature_descriptor D>
[[nodiscard]] bool is_possible(const basic_atlas<D>& maps, map_id from, map_id into, const loop_match& match) {
  return from != into && maps.has({from, match.keyframe}) && maps.has({into, match.candidate}) &&
         maps.at(into).landmark_ids_left() >= maps.at(from).landmark_end().value() &&
         maps.at(into).keyframe_ids_left() > maps.at(from).keyframe_end().value();
}

/// Copies the data needed to merge map `from`, which contains the keyframe of the match, into map `into`, which
/// contains the candidate. Empty if a map or keyframe no longer exists, or too few ids are left. O(features of the
/// neighbourhood).
template <feature_descriptor D>
[[nodiscard]] std::optional<snapshot<D>> take(const basic_atlas<D>& maps, map_id from, map_id into,
                                              const loop_match& match, const loop_fusion_options& o = {}) {
  if (!is_possible(maps, from, into, match)) return std::nullopt;
  return snapshot<D>{from, into, match, loop_fusion::take(maps.at(from), maps.at(into), match, o)};
}

/// Moves `from` according to the match, merges it into `into`, and adds a loop edge at the match. If `from` was active,
/// `into` becomes active. Changes nothing if a map or keyframe no longer exists. O(`from`). If the report indicates
/// that the maps were merged, the caller must then call `loop_fusion::fuse`.
template <feature_descriptor D>
report join(basic_atlas<D>& maps, const snapshot<D>& s) {
  report done;
  if (!is_possible(maps, s.from, s.into, s.match)) return done;
  basic_map<D>& m = maps.at(s.into);
  done.T_into_from = sim3(m.at(s.match.candidate).T_world_camera) * s.match.scaled_motion() *
                     sim3(maps.at(s.from).at(s.match.keyframe).T_world_camera.inverse());
  done.offsets = maps.merge(s.from, s.into, done.T_into_from, {s.match.candidate, s.match.keyframe});
  done.keyframe = s.match.keyframe + done.offsets.keyframes;
  done.candidate = s.match.candidate;
  m.add_loop_edge(done.keyframe, done.candidate);
  done.merged = true;
  return done;
}

}  // namespace orbis::slam::detail::map_merging

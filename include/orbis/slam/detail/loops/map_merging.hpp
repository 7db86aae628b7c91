// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Making one map of two that show the same place.
///
/// Source: C. Campos, R. Elvira, J. J. Gomez Rodriguez, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM3", T-RO 37 (2021),
/// section VI.
#pragma once

#include <optional>

#include <orbis/camera/model.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/slam/atlas.hpp>
#include <orbis/slam/detail/loops/loop_fusion.hpp>
#include <orbis/slam/detail/loops/loop_verification.hpp>
#include <orbis/slam/detail/map/landmark_search.hpp>
#include <orbis/slam/detail/mapping/landmark_fusion.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam::detail {

/// What merging two maps came to.
struct merge_report {
  bool merged = false;
  id_offsets offsets;            ///< what the numbers of the one map have grown by
  keyframe_id keyframe = no_id;  ///< that of the match, by its new number
  keyframe_id candidate = no_id;
  fusion_counts fusion;  ///< of landmarks
  se3 T_into_from;       ///< how the one map was moved
};

/// Merges map `from`, which has the keyframe of a match, into map `into`, which has the candidate, in three parts:
/// `gather` and `apply` touch the maps, `solve` works on what was copied out of them. In between both may grow.
template <camera::camera_model Camera>
class map_merging {
 public:
  /// False if a map or a keyframe is gone by now. O(features of the neighbourhood).
  bool gather(const atlas& maps, map_id from, map_id into, const loop_match& match,
              const optimize::reprojection<Camera>& model, const pyramid_scales& scales,
              const loop_fusion_options& o = {}) {
    from_ = from;
    into_ = into;
    match_ = match;
    model_.emplace(model);
    scales_ = scales;
    if (!is_there(maps)) return false;
    fusion_.gather(maps.at(from), maps.at(into), match, o);
    return true;
  }

  /// @pre `gather` was true
  void solve() { fusion_.solve(*model_, scales_); }

  /// Moves `from` to where the match says, hangs it on `into` at the match, notes a loop edge there, and makes one of
  /// the landmarks that are the same. If `from` was the active map, `into` is now. Nothing happens if a map or keyframe
  /// is gone by now. O(both maps).
  merge_report apply(atlas& maps) const {
    merge_report report;
    if (!is_there(maps)) return report;
    map& m = maps.at(into_);
    report.T_into_from = m.at(match_.candidate).T_world_camera * match_.T_candidate_keyframe *
                         maps.at(from_).at(match_.keyframe).T_world_camera.inverse();
    report.offsets = maps.merge(from_, into_, report.T_into_from, {match_.candidate, match_.keyframe});
    report.keyframe = match_.keyframe + report.offsets.keyframes;
    report.candidate = match_.candidate;
    m.add_loop_edge(report.keyframe, report.candidate);
    report.fusion = fusion_.fuse(m, report.offsets);
    report.merged = true;
    return report;
  }

 private:
  [[nodiscard]] bool is_there(const atlas& maps) const {
    return from_ != into_ && maps.contains(from_) && maps.contains(into_) &&
           maps.at(from_).has_keyframe(match_.keyframe) && maps.at(into_).has_keyframe(match_.candidate);
  }

  map_id from_ = 0, into_ = 0;
  loop_match match_;
  std::optional<optimize::reprojection<Camera>> model_;
  pyramid_scales scales_;
  loop_fusion fusion_;
};

/// Merges two maps at once; see `map_merging`. Nothing is changed where the report says that nothing was merged.
template <camera::camera_model Camera>
merge_report merge_maps(atlas& maps, map_id from, map_id into, const loop_match& match,
                        const optimize::reprojection<Camera>& model, const pyramid_scales& scales,
                        const loop_fusion_options& o = {}) {
  map_merging<Camera> merging;
  if (!merging.gather(maps, from, into, match, model, scales, o)) return {};
  merging.solve();
  return merging.apply(maps);
}

}  // namespace orbis::slam::detail

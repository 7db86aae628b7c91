// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Decides whether a frame becomes a keyframe.
#pragma once

#include <algorithm>
#include <cstddef>

#include <orbis/slam/detail/map/local_map.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

/// Quantities on which the decision depends.
struct keyframe_evidence {
  double since = 0.0;   ///< seconds since the last keyframe
  double moved = 0.0;   ///< translation since the last keyframe, metres (relative to scene depth if scale is unknown)
  double turned = 0.0;  ///< rotation since the last keyframe, radians
  double away = 0.0;    ///< rotation relative to the last keyframe or to the reference, whichever is nearer, radians
  std::size_t inliers = 0;          ///< number of landmarks tracked in the frame
  std::size_t reference = 0;        ///< number of landmarks of the reference keyframe that other keyframes also observe
  std::size_t close_tracked = 0;    ///< number of close keypoints that observe a landmark
  std::size_t close_untracked = 0;  ///< number of close keypoints that could become landmarks
  std::size_t keyframes = 0;        ///< number of keyframes in the map
};

/// Collects the evidence for a frame. @pre `reference` is a keyframe of the map
template <feature_descriptor D>
[[nodiscard]] keyframe_evidence gather_evidence(const basic_map<D>& m, const basic_frame<D>& f, keyframe_id reference,
                                                std::size_t inliers, const options& o, bool scale_is_known = true) {
  keyframe_evidence e;
  const auto& last = m.keyframes().back();
  e.since = f.timestamp - last.timestamp;
  const se3 motion = last.T_world_camera.inverse() * f.T_world_camera;
  e.moved = norm(motion.translation());
  if (!scale_is_known) {
    const double depth = median_depth(m, f);
    e.moved = depth > 0.0 ? e.moved / depth : 0.0;
  }
  e.turned = motion.rotation().angle();
  const so3 from_reference = m.at(reference).T_world_camera.rotation().inverse() * f.T_world_camera.rotation();
  e.away = std::min(e.turned, from_reference.angle());
  e.inliers = inliers;
  e.keyframes = m.keyframes().size();
  // Without depth, a landmark is created from two observations; only a third one confirms it.
  const std::size_t seen_by_others = std::min<std::size_t>(scale_is_known ? 2 : 3, e.keyframes);
  for (const landmark_id l : m.at(reference).landmarks)
    if (l != no_id && m.landmark_at(l).observations.size() >= seen_by_others) ++e.reference;
  for (std::size_t i = 0; i < f.size(); ++i) {
    if (!f.has_depth(i) || static_cast<double>(f.depth[i]) > o.close_depth) continue;
    ++(f.landmarks[i] != no_id ? e.close_tracked : e.close_untracked);
  }
  return e;
}

/// Returns true if the view has changed significantly, if too few close keypoints observe landmarks and many others
/// could become landmarks, if the camera has turned far, or if some time has passed since the last keyframe and the
/// camera has moved. Always false with too few inliers.
[[nodiscard]] inline bool is_keyframe_due(const keyframe_evidence& e, const keyframe_options& o) {
  if (e.inliers <= o.min_inliers) return false;
  const double ratio = e.keyframes < 2 ? o.inlier_ratio_start : o.inlier_ratio;
  const bool view_changed = static_cast<double>(e.inliers) < ratio * static_cast<double>(e.reference);
  const bool needs_close = e.close_tracked < o.close_tracked && e.close_untracked > o.close_untracked;
  const bool has_moved = e.since >= o.interval && (e.moved >= o.moved || e.turned >= o.turned);
  return view_changed || needs_close || has_moved || e.away >= o.max_turned;
}

}  // namespace orbis::slam::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Where two parts of a map, or two maps, that show the same place are sewn together: which keypoints of one show which
/// landmarks of the other.
///
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM: a versatile and accurate monocular SLAM system",
/// T-RO 31 (2015), section VII.C.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/slam/detail/loops/landmark_snapshot.hpp>
#include <orbis/slam/detail/loops/loop_verification.hpp>
#include <orbis/slam/detail/map/counter.hpp>
#include <orbis/slam/detail/map/keyframe_motion.hpp>
#include <orbis/slam/detail/map/landmark_search.hpp>
#include <orbis/slam/detail/map/point_observation.hpp>
#include <orbis/slam/detail/mapping/landmark_fusion.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

/// In three parts: `gather` copies what it takes, `solve` finds the pairs on the copies, `sew` enters them into the
/// map.
class loop_fusion {
 public:
  /// The neighbourhood of the keyframe and the place around the candidate. O(features of the neighbourhood).
  /// @pre the keyframes of the match are there
  void gather(const map& current, const map& candidate_map, const loop_match& match, const loop_fusion_options& o) {
    match_ = match;
    options_ = o;
    place_ = snapshot_around(candidate_map, match.candidate, o.neighbors);
    images_.clear();
    const se3 T_camera_world = current.at(match.keyframe).T_world_camera.inverse();
    for (const keyframe_id k : neighborhood(current, match.keyframe)) {
      if (images_.size() > o.keyframes) break;
      images_.push_back({k, current.at(k), T_camera_world * current.at(k).T_world_camera});
    }
  }

  /// Each keyframe of the neighbourhood is looked at from where the match puts it.
  template <camera::camera_model Camera>
  void solve(const optimize::reprojection<Camera>& model, const pyramid_scales& scales) {
    pairs_.clear();
    for (const loop_pair& p : match_.matches) pairs_.push_back({match_.keyframe, p});
    for (const image& i : images_) {
      const se3 T_world_camera = place_.T_world_camera * match_.T_candidate_keyframe * i.T_keyframe_camera;
      const se3 T_camera_world = T_world_camera.inverse();
      for (const features::match& m :
           find_landmarks(place_, i.seen, T_world_camera, model.camera, scales, options_.radius, options_.distance)) {
        const snapshot_landmark& l = place_.landmarks[m.query];
        if (agrees(model, scales, i.seen, T_camera_world, m.train, l.position))
          pairs_.push_back({i.keyframe, {m.train, l.id}});
      }
    }
  }

  /// Makes one of the landmarks that are the same: those of the candidate's side stay. `shift` is what the numbers of
  /// the keyframe's side have grown by, if that was a map of its own. What is gone by now is left out. Returns what
  /// came of it; landmarks that have changed are updated.
  fusion_counts fuse(map& m, const id_offsets& shift = {}) const {
    fusion_counts counts;
    counter changed;
    for (const found& f : pairs_) {
      const keyframe_id k = f.keyframe + shift.keyframes;
      const landmark_id l = m.became(f.pair.landmark);
      if (!m.has_keyframe(k) || l == no_id || m.landmark_at(l).seen_by(k) != nullptr) continue;
      const landmark_id shown = m.at(k).landmarks[f.pair.feature];
      if (shown == no_id) {
        m.observe(l, k, f.pair.feature);
        ++counts.observed;
      } else {
        m.fuse(shown, l);
        ++counts.fused;
      }
      changed.add(l);
    }
    for (const counter::entry& e : changed.entries())
      if (m.has_landmark(e.number)) m.update(e.number);
    return counts;
  }

 private:
  struct image {
    keyframe_id keyframe;
    frame seen;
    se3 T_keyframe_camera;  ///< to the keyframe of the match
  };
  struct found {
    keyframe_id keyframe;
    loop_pair pair;
  };

  loop_match match_;
  loop_fusion_options options_;
  landmark_snapshot place_;
  std::vector<image> images_;
  std::vector<found> pairs_;
};

}  // namespace orbis::slam::detail

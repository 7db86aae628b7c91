// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Fusion of the landmarks of two parts of a map, or of two maps, that observe the same place.
///
/// `take` copies the necessary data, `find_pairs` finds the keypoints of one side that observe landmarks of the other,
/// and `fuse` applies the result to the map.
///
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM: a versatile and accurate monocular SLAM system",
/// T-RO 31 (2015), section VII.C.
#pragma once

#include <span>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/features/match.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/loops/landmark_snapshot.hpp>
#include <orbis/slam/detail/loops/loop_verification.hpp>
#include <orbis/slam/detail/map/counter.hpp>
#include <orbis/slam/detail/map/keyframe_motion.hpp>
#include <orbis/slam/detail/map/point_observation.hpp>
#include <orbis/slam/detail/mapping/landmark_fusion.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail::loop_fusion {

/// A keyframe in the neighbourhood of the match's keyframe.
template <feature_descriptor D>
struct image {
  keyframe_id keyframe;
  basic_frame<D> seen;
  se3 T_keyframe_camera;  ///< relative to the keyframe of the match
};

template <feature_descriptor D>
struct snapshot {
  loop_match match;
  landmark_snapshot<D> landmarks;  ///< around the candidate
  std::vector<image<D>> images;    ///< the keyframe and its neighbours
};

/// A keyframe that observes a landmark of the candidate's neighbourhood.
struct pair {
  keyframe_id keyframe;
  loop_pair observed;
};

/// Copies the neighbourhood of the keyframe and the landmarks around the candidate. O(features of the neighbourhood).
/// @pre the keyframes of the match exist
template <feature_descriptor D>
[[nodiscard]] snapshot<D> take(const basic_map<D>& current, const basic_map<D>& candidate_map, const loop_match& match,
                               const loop_fusion_options& o) {
  snapshot<D> s{match, snapshot_around(candidate_map, match.candidate, o.neighbors), {}};
  const se3 T_camera_world = current.at(match.keyframe).T_world_camera.inverse();
  for (const keyframe_id k : neighborhood(current, match.keyframe)) {
    if (s.images.size() > o.keyframes) break;
    s.images.push_back({k, current.at(k), T_camera_world * current.at(k).T_world_camera});
  }
  return s;
}

/// Returns the pairs of the match, and the landmarks found in each image at the pose that follows from the match.
template <camera::camera_model Camera, feature_descriptor D>
[[nodiscard]] std::vector<pair> find_pairs(const snapshot<D>& s, const camera_rig<Camera>& rig,
                                           const loop_fusion_options& o) {
  std::vector<pair> pairs;
  for (const loop_pair& p : s.match.matches) pairs.push_back({s.match.keyframe, p});
  for (const image<D>& i : s.images) {
    const se3 T_world_camera =
        s.landmarks.T_world_camera * s.match.T_candidate_keyframe * scaled(i.T_keyframe_camera, s.match.scale);
    const se3 T_camera_world = T_world_camera.inverse();
    for (const features::match& m : find_landmarks(s.landmarks, i.seen, T_world_camera, rig, o.radius, o.distance)) {
      const snapshot_landmark& l = s.landmarks.landmarks[m.query];
      if (agrees(rig, i.seen, T_camera_world, m.train, l.position)) pairs.push_back({i.keyframe, {m.train, l.id}});
    }
  }
  return pairs;
}

/// For each pair, fuses the landmark that the keypoint observes, if any, into the pair's landmark; otherwise adds an
/// observation. `offsets`: offsets added to the ids of the keyframe's map, if that was a separate map. Pairs whose
/// keyframe or landmark no longer exists are skipped. Changed landmarks are updated. Callers that share the map can
/// pass the pairs in parts: the result is the same.
template <feature_descriptor D>
fusion_counts fuse(basic_map<D>& m, std::span<const pair> pairs, const id_offsets& offsets = {}) {
  fusion_counts counts;
  counter<landmark_id> changed;
  for (const pair& p : pairs) {
    const keyframe_id k = p.keyframe + offsets.keyframes;
    const landmark_id l = m.replacement(p.observed.landmark);
    if (!m.has_keyframe(k) || l == no_id || m.landmark_at(l).seen_by(k) != nullptr) continue;
    const landmark_id shown = m.at(k).landmarks[p.observed.feature];
    if (shown == no_id) {
      m.add_observation(l, k, p.observed.feature);
      ++counts.observed;
    } else {
      m.fuse(shown, l);
      ++counts.fused;
    }
    changed.add(l);
  }
  for (const auto& e : changed.entries())
    if (m.has_landmark(e.id)) m.update_landmark(e.id);
  return counts;
}

}  // namespace orbis::slam::detail::loop_fusion

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Search for duplicate landmarks around a keyframe, and their fusion.
///
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM: a versatile and accurate monocular SLAM system",
/// T-RO 31 (2015), sections VI.C and VII.C.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/features/match.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/stages.hpp>
#include <orbis/features/windowed.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/map/counter.hpp>
#include <orbis/slam/detail/map/landmark_search.hpp>
#include <orbis/slam/detail/map/local_map.hpp>
#include <orbis/slam/detail/map/point_observation.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

struct fusion_counts {
  std::size_t fused = 0;     ///< number of landmarks fused into another one
  std::size_t observed = 0;  ///< number of added observations
};

/// Searches for landmarks in a keyframe that does not observe them. If the keypoint found observes another landmark,
/// both are fused: the one with fewer observations into the other, or the younger into the older if the numbers are
/// equal. If it observes none, an observation is added. The descriptors must match, and the position must agree with
/// the keypoint (95 %). Changed landmarks are updated.
template <feature_descriptor D, camera::camera_model Camera>
fusion_counts fuse_into(basic_map<D>& m, keyframe_id id, std::span<const landmark_id> landmarks,
                        const camera_rig<Camera>& rig, const fusion_options& o = {}) {
  const auto& k = m.at(id);
  const se3 T_camera_world = k.T_world_camera.inverse();
  const features::camera_projection project{rig.camera(), k.T_world_camera};
  const features::projection_rule rule = make_rule(rig.scales, o.radius);
  search_list<D> list;
  for (const landmark_id l : landmarks)
    if (m.has_landmark(l) && m.landmark_at(l).seen_by(id) == nullptr)
      add_landmark(list, project, rule, m.landmark_at(l), l);
  const auto matcher = features::windowed(distance_of_t<D>{}) | features::max_distance{o.distance} | features::unique{};
  fusion_counts counts;
  for (const features::match& found : matcher(list.descriptors, k.features, list.windows, k.grid)) {
    const landmark_id l = list.points[found.query].landmark;
    if (!m.has_landmark(l) || m.landmark_at(l).seen_by(id) != nullptr ||
        !agrees<Camera, D>(rig, k, T_camera_world, found.train, m.landmark_at(l).position))
      continue;
    if (const landmark_id shown = k.landmarks[found.train]; shown == no_id) {
      m.add_observation(l, id, found.train);
      m.update_landmark(l);
      ++counts.observed;
    } else {
      const std::size_t a = m.landmark_at(l).observations.size(), b = m.landmark_at(shown).observations.size();
      const bool keeps_shown = b != a ? b > a : shown < l;
      m.fuse(keeps_shown ? l : shown, keeps_shown ? shown : l);
      m.update_landmark(keeps_shown ? shown : l);
      ++counts.fused;
    }
  }
  return counts;
}

/// Searches for the landmarks of a keyframe in its neighbours and their neighbours, and vice versa (`fuse_into`).
/// O(neighbours).
template <feature_descriptor D, camera::camera_model Camera>
fusion_counts fuse_with_neighbors(basic_map<D>& m, keyframe_id id, const camera_rig<Camera>& rig,
                                  const fusion_options& o = {}) {
  counter<keyframe_id> taken;
  taken.add(id);
  std::vector<keyframe_id> around;
  const auto take = [&](keyframe_id k) {
    if (taken.add(k)) around.push_back(k);
  };
  const std::vector<covisible> first = m.covisibility().neighbors(id, o.neighbors);
  for (const covisible& n : first) take(n.keyframe);
  for (const covisible& n : first)
    for (const covisible& second : m.covisibility().neighbors(n.keyframe, o.second_order)) take(second.keyframe);

  fusion_counts all;
  const auto add = [&](const fusion_counts& c) {
    all.fused += c.fused;
    all.observed += c.observed;
  };
  const std::vector<landmark_id> own = observed_landmarks(m, {id});
  for (const keyframe_id k : around) add(fuse_into<D>(m, k, own, rig, o));
  add(fuse_into<D>(m, id, observed_landmarks(m, around), rig, o));
  return all;
}

}  // namespace orbis::slam::detail

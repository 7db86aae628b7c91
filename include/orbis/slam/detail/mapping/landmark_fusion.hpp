// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Finding landmarks that are the same, and making them one.
///
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM: a versatile and accurate monocular SLAM system",
/// T-RO 31 (2015), sections VI.C and VII.C.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/features/hamming.hpp>
#include <orbis/features/match.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/stages.hpp>
#include <orbis/features/windowed.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/slam/detail/map/counter.hpp>
#include <orbis/slam/detail/map/landmark_search.hpp>
#include <orbis/slam/detail/map/local_map.hpp>
#include <orbis/slam/detail/map/point_observation.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam::detail {

struct fusion_options {
  double radius = 4.0;           ///< of the search around a projection, pixels of a keypoint's level
  std::uint32_t distance = 50;   ///< bits by which descriptors may differ
  std::size_t neighbors = 10;    ///< keyframes around one that are searched, and ...
  std::size_t second_order = 5;  ///< ... of each of these so many more
};

struct fusion_counts {
  std::size_t fused = 0;     ///< pairs of landmarks that were one
  std::size_t observed = 0;  ///< landmarks that a keypoint was found to show
};

/// Looks for landmarks in a keyframe that does not know it sees them. A keypoint that shows another landmark fuses both
/// (the one with fewer observations into the other, the younger where equal); one that shows none is a new observation.
/// Landmarks that have changed are updated. The descriptors must be alike, and the position agree with the keypoint.
template <camera::camera_model Camera>
fusion_counts fuse_into(map& m, keyframe_id id, std::span<const landmark_id> landmarks,
                        const optimize::reprojection<Camera>& model, const pyramid_scales& scales,
                        const fusion_options& o = {}) {
  const keyframe& k = m.at(id);
  const se3 T_camera_world = k.T_world_camera.inverse();
  const features::camera_projection project{model.camera, k.T_world_camera};
  const features::projection_rule rule = rule_of(scales, o.radius);
  search_list list;
  for (const landmark_id l : landmarks)
    if (m.has_landmark(l) && m.landmark_at(l).seen_by(id) == nullptr)
      add_landmark(list, project, rule, m.landmark_at(l), l);
  const auto matcher =
      features::windowed(features::hamming{}) | features::max_distance{o.distance} | features::unique{};
  fusion_counts counts;
  for (const features::match& found : matcher(list.descriptors, k.features, list.windows, k.grid)) {
    const landmark_id l = list.points[found.query].landmark;
    if (!m.has_landmark(l) || m.landmark_at(l).seen_by(id) != nullptr ||
        !agrees(model, scales, k, T_camera_world, found.train, m.landmark_at(l).position))
      continue;
    if (const landmark_id shown = k.landmarks[found.train]; shown == no_id) {
      m.observe(l, id, found.train);
      m.update(l);
      ++counts.observed;
    } else {
      const std::size_t a = m.landmark_at(l).observations.size(), b = m.landmark_at(shown).observations.size();
      const bool keeps_shown = b != a ? b > a : shown < l;
      m.fuse(keeps_shown ? l : shown, keeps_shown ? shown : l);
      m.update(keeps_shown ? shown : l);
      ++counts.fused;
    }
  }
  return counts;
}

/// Looks for the landmarks of a keyframe in its neighbours and their neighbours, and for theirs in it. O(neighbours).
template <camera::camera_model Camera>
fusion_counts fuse_with_neighbors(map& m, keyframe_id id, const optimize::reprojection<Camera>& model,
                                  const pyramid_scales& scales, const fusion_options& o = {}) {
  counter taken;
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
  const std::vector<landmark_id> own = landmarks_of(m, {id});
  for (const keyframe_id k : around) add(fuse_into(m, k, own, model, scales, o));
  add(fuse_into(m, id, landmarks_of(m, around), model, scales, o));
  return all;
}

}  // namespace orbis::slam::detail

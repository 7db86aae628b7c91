// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Local bundle adjustment: the newest keyframe, its neighbours, and all they see.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/optimize/bundle_adjustment.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/slam/landmark_search.hpp>
#include <orbis/slam/local_map.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>
#include <orbis/slam/pose_tracker.hpp>

namespace orbis::slam {

/// Moves the keyframes around `newest` and their landmarks to where the observations agree best.
/// Other keyframes that see these landmarks hold the whole in place, as does the root of the map.
/// Observations that disagree afterwards are forgotten.
template <camera::camera_model Camera>
void adjust_locally(map& m, keyframe_id newest, optimize::bundle_adjuster<optimize::reprojection<Camera>>& adjuster,
                    const optimize::reprojection<Camera>& model, const pyramid_scales& scales,
                    const adjustment_options& o) {
  if (m.keyframes().size() < 2 || o.keyframes == 0) return;
  std::vector<keyframe_id> keyframes{newest};
  for (const auto& [k, shared] : m.sharing(m.at(newest).landmarks))
    if (k != newest && shared >= o.min_shared && keyframes.size() < o.keyframes) keyframes.push_back(k);
  const std::vector<landmark_id> landmarks = landmarks_of(m, keyframes);

  std::vector<std::uint32_t> index(m.keyframe_end(), no_id);
  std::vector<std::uint8_t> is_fixed;
  for (std::uint32_t i = 0; i < keyframes.size(); ++i) {
    index[keyframes[i]] = i;
    is_fixed.push_back(keyframes[i] == m.tree().root() ? 1 : 0);
  }
  std::vector<vec3> points;
  std::vector<optimize::bundle_observation> observations;
  std::vector<observation> sources;  // of each of these, the keyframe and keypoint
  for (std::uint32_t p = 0; p < landmarks.size(); ++p) {
    const landmark& l = m.landmark_at(landmarks[p]);
    points.push_back(l.position);
    for (const observation& seen : l.observations) {
      if (index[seen.keyframe] == no_id) {
        index[seen.keyframe] = static_cast<std::uint32_t>(keyframes.size());
        keyframes.push_back(seen.keyframe);
        is_fixed.push_back(1);
      }
      const auto at = observation_of(model, scales, m.at(seen.keyframe), seen.feature, l.position);
      observations.push_back({index[seen.keyframe], p, at.pixel, at.right, at.information});
      sources.push_back(seen);
    }
  }
  if (std::find(is_fixed.begin(), is_fixed.end(), 1) == is_fixed.end())
    is_fixed[static_cast<std::size_t>(std::min_element(keyframes.begin(), keyframes.end()) - keyframes.begin())] = 1;

  std::vector<se3> poses;
  for (const keyframe_id k : keyframes) poses.push_back(m.at(k).T_world_camera);
  std::vector<std::uint8_t> outliers(observations.size(), 0);
  std::vector<double> squared(observations.size());
  const auto find_outliers = [&] {
    adjuster.chi2(poses, points, observations, squared);
    for (std::size_t i = 0; i < observations.size(); ++i)
      outliers[i] = squared[i] > (std::isnan(observations[i].right) ? 5.991 : 7.815) ? 1 : 0;
  };
  (void)adjuster.solve(seq, std::span<se3>(poses), std::span<vec3>(points),
                       std::span<const optimize::bundle_observation>(observations),
                       {.max_iterations = o.robust_iterations, .fixed_poses = is_fixed});
  find_outliers();
  (void)adjuster.solve_again(seq, std::span<se3>(poses), std::span<vec3>(points),
                             {.max_iterations = o.iterations, .fixed_poses = is_fixed, .ignored = outliers});
  find_outliers();

  for (std::size_t i = 0; i < keyframes.size(); ++i)
    if (is_fixed[i] == 0) m.set_pose(keyframes[i], poses[i]);
  for (std::size_t p = 0; p < landmarks.size(); ++p) m.set_position(landmarks[p], points[p]);
  for (std::size_t i = 0; i < observations.size(); ++i)
    if (outliers[i] != 0) m.forget(landmarks[observations[i].point], sources[i].keyframe);
  for (const landmark_id l : landmarks)
    if (m.is_alive(l)) m.update(l);
}

}  // namespace orbis::slam

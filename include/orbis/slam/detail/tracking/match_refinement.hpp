// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The pose of a frame from matches between known points and its keypoints.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/features/match.hpp>
#include <orbis/optimize/pose_refinement.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/map/landmark_search.hpp>
#include <orbis/slam/detail/map/point_observation.hpp>

namespace orbis::slam::detail {

/// Refines the pose of `f` on matches of `list` (query) with its keypoints (train), starting from `f.T_world_camera`,
/// and sets `f.landmarks` to those that agree with the result. Returns the number of matches that agree; 0, and an
/// unchanged pose, where the pose cannot be determined.
template <feature_descriptor D, camera::camera_model Camera>
std::size_t refine_on_matches(basic_frame<D>& f, const search_list<D>& list, std::span<const features::match> matches,
                              const camera_rig<Camera>& rig) {
  std::vector<optimize::pose_observation> observations;
  observations.reserve(matches.size());
  for (const auto& m : matches) observations.push_back(observation_of(rig, f, m.train, list.points[m.query].position));
  std::vector<std::uint8_t> outliers(matches.size());
  const auto refined = optimize::refine_pose(std::span<const optimize::pose_observation>(observations), rig.model,
                                             f.T_world_camera, std::span<std::uint8_t>(outliers));
  f.landmarks.assign(f.size(), no_id);
  if (!refined.ok()) return 0;
  f.T_world_camera = refined.T_world_camera;
  for (std::size_t i = 0; i < matches.size(); ++i)
    if (outliers[i] == 0) f.landmarks[matches[i].train] = list.points[matches[i].query].landmark;
  return refined.inliers;
}

}  // namespace orbis::slam::detail

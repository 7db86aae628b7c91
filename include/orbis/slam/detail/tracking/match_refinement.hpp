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
#include <orbis/slam/detail/map/landmark_search.hpp>
#include <orbis/slam/detail/map/point_observation.hpp>

namespace orbis::slam::detail {

/// Refines the pose of `f` on matches of `list` (query) with its keypoints (train), and notes the
/// landmarks of those that agree with it in `f.landmarks`. Returns how many matches agree; 0 and an
/// untouched pose where the pose cannot be told.
template <camera::camera_model Camera>
std::size_t refine_on_matches(frame& f, const search_list& list, std::span<const features::match> matches,
                              const optimize::reprojection<Camera>& model, const pyramid_scales& scales) {
  std::vector<optimize::pose_observation> observations;
  observations.reserve(matches.size());
  for (const auto& m : matches)
    observations.push_back(observation_of(model, scales, f, m.train, list.points[m.query].position));
  std::vector<std::uint8_t> outliers(matches.size());
  const auto refined = optimize::refine_pose(std::span<const optimize::pose_observation>(observations), model,
                                             f.T_world_camera, std::span<std::uint8_t>(outliers));
  f.landmarks.assign(f.size(), no_id);
  if (!refined.ok()) return 0;
  f.T_world_camera = refined.T_world_camera;
  for (std::size_t i = 0; i < matches.size(); ++i)
    if (outliers[i] == 0) f.landmarks[matches[i].train] = list.points[matches[i].query].landmark;
  return refined.inliers;
}

}  // namespace orbis::slam::detail

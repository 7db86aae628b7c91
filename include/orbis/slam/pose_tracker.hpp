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
#include <orbis/slam/landmark_search.hpp>
#include <orbis/slam/observed_point.hpp>

namespace orbis::slam {

namespace detail {

/// Matches that can be right if the pose is what the founded landmarks among them say, which is put into `pose`. All of
/// them, and the pose untouched, where there are too few founded ones or these do not agree.
template <camera::camera_model Camera>
[[nodiscard]] std::vector<features::match> agreeing_with_founded(const frame& f, const search_list& list,
                                                                 std::span<const features::match> matches,
                                                                 const optimize::reprojection<Camera>& model,
                                                                 const pyramid_scales& scales, se3& pose) {
  constexpr std::size_t enough = 30;
  constexpr double gate = 4.0;  // times what the errors of true matches stay below: the pose is preliminary
  std::vector<optimize::pose_observation> observations;
  observations.reserve(matches.size());
  for (const auto& m : matches)
    if (const candidate_point& p = list.points[m.query]; p.is_founded)
      observations.push_back(observation_of(model, scales, f, m.train, p.position));
  std::vector<features::match> all(matches.begin(), matches.end());
  if (observations.size() < enough) return all;
  std::vector<std::uint8_t> outliers(observations.size());
  const auto refined = optimize::refine_pose(std::span<const optimize::pose_observation>(observations), model, pose,
                                             std::span<std::uint8_t>(outliers));
  if (!refined.ok() || refined.inliers < enough || 2 * refined.inliers < observations.size()) return all;
  const se3 T_camera_world = refined.T_world_camera.inverse();
  std::erase_if(all, [&](const features::match& m) {
    return !agrees(model, scales, f, T_camera_world, m.train, list.points[m.query].position, gate);
  });
  pose = refined.T_world_camera;
  return all;
}

}  // namespace detail

/// Refines the pose of `f` on matches of `list` (query) with its keypoints (train), and notes the
/// landmarks of those that agree with it in `f.landmarks`. Founded landmarks have the first say: what moves through the
/// view may have more features than what stands still. Returns how many matches agree; 0 and an
/// untouched pose where the pose cannot be told.
template <camera::camera_model Camera>
std::size_t refine_on_matches(frame& f, const search_list& list, std::span<const features::match> found,
                              const optimize::reprojection<Camera>& model, const pyramid_scales& scales) {
  se3 start = f.T_world_camera;
  const std::vector<features::match> matches = detail::agreeing_with_founded(f, list, found, model, scales, start);
  std::vector<optimize::pose_observation> observations;
  observations.reserve(matches.size());
  for (const auto& m : matches)
    observations.push_back(observation_of(model, scales, f, m.train, list.points[m.query].position));
  std::vector<std::uint8_t> outliers(matches.size());
  const auto refined = optimize::refine_pose(std::span<const optimize::pose_observation>(observations), model, start,
                                             std::span<std::uint8_t>(outliers));
  f.landmarks.assign(f.size(), no_id);
  if (!refined.ok()) return 0;
  f.T_world_camera = refined.T_world_camera;
  for (std::size_t i = 0; i < matches.size(); ++i)
    if (outliers[i] == 0) f.landmarks[matches[i].train] = list.points[matches[i].query].landmark;
  return refined.inliers;
}

}  // namespace orbis::slam

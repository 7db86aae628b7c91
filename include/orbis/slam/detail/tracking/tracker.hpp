// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Estimation of a frame's pose: from the last frame, from a keyframe, or from the landmarks around it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/match.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/project_points.hpp>
#include <orbis/optimize/pnp.hpp>
#include <orbis/optimize/pose_refinement.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/dynamics/moving_features.hpp>
#include <orbis/slam/detail/map/landmark_search.hpp>
#include <orbis/slam/detail/map/local_map.hpp>
#include <orbis/slam/detail/map/point_observation.hpp>
#include <orbis/slam/frame.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/matchers.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

/// Refines the pose of `f` on matches of `list` (query) with its keypoints (train), starting from `f.T_world_camera`,
/// and sets `f.landmarks` to the landmarks of the matches that agree with the result. Returns the number of matches
/// that agree; 0, with an unchanged pose, if the pose cannot be determined.
template <feature_descriptor D, camera::camera_model Camera>
std::size_t refine_on_matches(basic_frame<D>& f, const search_list<D>& list, std::span<const features::match> matches,
                              const camera_rig<Camera>& rig) {
  std::vector<optimize::pose_observation> observations;
  observations.reserve(matches.size());
  for (const auto& m : matches)
    observations.push_back(make_observation(rig, f, m.train, list.points[m.query].position));
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

/// Refines the pose of `f` on its landmarks, and keeps the landmarks that agree with the result. Returns their number;
/// 0 if the pose cannot be determined. @pre f.spreads is set
template <feature_descriptor D, camera::camera_model Camera>
std::size_t refine_on_landmarks(basic_frame<D>& f, const basic_map<D>& m, const camera_rig<Camera>& rig) {
  std::vector<optimize::pose_observation> observations;
  std::vector<std::size_t> keypoints;
  observations.reserve(f.size());
  keypoints.reserve(f.size());
  for (std::size_t i = 0; i != f.size(); ++i) {
    if (f.landmarks[i] == no_id) continue;
    observations.push_back(landmark_observation(rig, f, i, m.landmark_at(f.landmarks[i]).position));
    keypoints.push_back(i);
  }
  std::vector<std::uint8_t> outliers(keypoints.size());
  const auto refined = optimize::refine_pose(std::span<const optimize::pose_observation>(observations), rig.model,
                                             f.T_world_camera, std::span<std::uint8_t>(outliers));
  if (!refined.ok()) return 0;
  f.T_world_camera = refined.T_world_camera;
  const se3 T_camera_world = f.T_world_camera.inverse();
  std::size_t kept = refined.inliers;
  for (std::size_t k = 0; k != keypoints.size(); ++k) {
    if (outliers[k] == 0) continue;
    const std::size_t i = keypoints[k];
    f.spreads[i].deviation = std::max(1.0F, f.spreads[i].deviation);
    if (agrees(rig, f, T_camera_world, i, observations[k].point))
      ++kept;
    else
      f.landmarks[i] = no_id;
  }
  return kept;
}

/// Estimates poses of frames in a map. Each function sets the pose of the frame and the landmarks that agree with it,
/// and returns the number of matches that agree, or 0 if the pose cannot be determined. The map is not changed.
///
/// Source of the method and its parameters: R. Mur-Artal, J. D. Tardos, "ORB-SLAM2: an open-source SLAM system for
/// monocular, stereo and RGB-D cameras", T-RO 33 (2017).
template <camera::camera_model Camera, feature_descriptor D, tracking_matchers<D> Matchers>
class tracker {
 public:
  tracker(const camera_rig<Camera>& rig, const options& settings) : rig_{rig}, options_{settings} {}

  /// Searches for the points observed by the last frame: its landmarks, and its other points with depth. The pose in
  /// `last` is up to date; its landmark ids are those at the time it was tracked. `predicted`: the expected
  /// `T_world_camera`.
  std::size_t by_motion(basic_frame<D>& f, const basic_map<D>& m, const basic_frame<D>& last, const se3& predicted,
                        moving_features<Camera, D, Matchers>& moving) const {
    for (const double widening : {1.0, 2.0}) {
      f.T_world_camera = predicted;
      const search_list<D> list = seen_points(m, last, predicted, widening * options_.motion_radius);
      std::vector<features::match> matches = Matchers::motion(
          features::feature_view<D>{list.keypoints, list.descriptors}, f.features, list.windows, f.grid);
      moving.remove_excluded(matches);
      if (matches.size() < options_.min_inliers) continue;
      const std::size_t fitted = refine_on_matches<D>(f, list, matches, rig_);
      if (const std::size_t inliers = moving.judge(f, m, list, matches, fitted, predicted); inliers >= 10)
        return inliers;
    }
    return 0;
  }

  /// Like `by_motion`, for a camera that may have turned in any direction by up to half of its field of view since the
  /// last frame: searches with a grid of rotations at the position of the last frame, and tries those with the most
  /// matches. Takes about 80 searches.
  std::size_t by_turning(basic_frame<D>& f, const basic_map<D>& m, const basic_frame<D>& last) const {
    const auto& camera = rig_.camera();
    const auto corner = camera.unproject({0.0, 0.0});
    if (!corner) return 0;
    const double wide = std::atan(std::abs(corner->x())), high = std::atan(std::abs(corner->y()));
    struct attempt {
      std::size_t matches;
      se3 T_world_camera;
    };
    std::vector<attempt> attempts;
    constexpr int steps = 4;  // from the centre of the view to its edge
    const double radius = 4.0 * options_.motion_radius;
    for (int across = -steps; across <= steps; ++across)
      for (int down = -steps; down <= steps; ++down) {
        const vec3 turn(high * down / steps, wide * across / steps, 0.0);
        const se3 turned = last.T_world_camera * se3{so3::exp(turn), zeros<vec3>()};
        const search_list<D> list = seen_points(m, last, turned, radius);
        if (list.size() < options_.min_inliers) continue;
        const auto matches = Matchers::motion(features::feature_view<D>{list.keypoints, list.descriptors}, f.features,
                                              list.windows, f.grid);
        attempts.push_back({matches.size(), turned});
      }
    std::stable_sort(attempts.begin(), attempts.end(),
                     [](const attempt& a, const attempt& b) { return a.matches > b.matches; });
    if (attempts.size() > 3) attempts.resize(3);
    for (const attempt& a : attempts) {
      f.T_world_camera = a.T_world_camera;
      const search_list<D> list = seen_points(m, last, a.T_world_camera, radius);
      const auto matches = Matchers::motion(features::feature_view<D>{list.keypoints, list.descriptors}, f.features,
                                            list.windows, f.grid);
      if (matches.size() < options_.min_inliers) return 0;
      const std::size_t inliers = refine_on_matches<D>(f, list, matches, rig_);
      if (inliers >= 10) return inliers;
    }
    return 0;
  }

  /// Matches a frame with a keyframe by descriptors and estimates its pose by RANSAC. @pre m.has_keyframe(id)
  std::size_t by_appearance(basic_frame<D>& f, const basic_map<D>& m, keyframe_id id) const {
    const auto& k = m.at(id);
    search_list<D> list;
    std::vector<features::match> usable;
    std::vector<vec3> points;
    std::vector<vec2> pixels;
    for (const features::match& found : Matchers::appearance(k.features, f.features)) {
      candidate_point p;
      p.landmark = k.landmarks[found.query];
      if (p.landmark != no_id)
        p.position = m.landmark_at(p.landmark).position;
      else if (k.has_depth(found.query))
        p.position = k.point_world(found.query);
      else
        continue;
      usable.push_back({static_cast<std::uint32_t>(list.size()), found.train, found.distance});
      list.points.push_back(p);
      points.push_back(p.position);
      pixels.push_back(f.pixel(found.train));
    }
    constexpr std::size_t enough = 12;
    const auto pose = optimize::estimate_pose(
        std::span<const vec3>(points), std::span<const vec2>(pixels), rig_.camera(),
        {.threshold = 5.0, .max_iterations = 500, .min_inliers = enough, .seed = options_.seed});
    if (!pose) return 0;
    f.T_world_camera = pose->T_world_camera;
    const std::size_t inliers = refine_on_matches<D>(f, list, usable, rig_);
    return inliers >= enough ? inliers : 0;
  }

  /// Searches for the landmarks of the local map in a frame whose pose is roughly known, within `radius` pixels of a
  /// keypoint's level. Calls `expected(id)` for the landmarks that the frame is expected to observe, and `found(id)`
  /// for those that it observes.
  template <class Expected, class Found>
  std::size_t on_local_map(basic_frame<D>& f, const basic_map<D>& m, keyframe_id reference, double radius,
                           const moving_features<Camera, D, Matchers>& moving, Expected&& expected,
                           Found&& found) const {
    const features::camera_projection project{rig_.camera(), f.T_world_camera};
    const features::projection_rule rule = make_rule(rig_.scales, radius);
    const std::vector<landmark_id> around = local_landmarks(m, f, reference, options_.local_keyframes);
    search_list<D> list;
    list.reserve(around.size());
    for (const landmark_id id : around)
      if (!moving.is_excluded(m, id, f.timestamp) && add_landmark(list, project, rule, m.landmark_at(id), id))
        expected(id);
    std::vector<features::match> matches = Matchers::landmarks(list.descriptors, f.features, list.windows, f.grid);
    moving.remove_excluded(matches);
    const std::size_t inliers = refine_on_matches<D>(f, list, matches, rig_);
    for (const landmark_id l : f.landmarks)
      if (l != no_id) found(l);
    return inliers;
  }

 private:
  /// Returns the points observed by the last frame, projected into a camera at a pose, with search windows of `radius`
  /// pixels.
  [[nodiscard]] search_list<D> seen_points(const basic_map<D>& m, const basic_frame<D>& last, const se3& T_world_camera,
                                           double radius) const {
    const features::camera_projection project{rig_.camera(), T_world_camera};
    search_list<D> list;
    list.reserve(last.size());
    for (std::size_t i = 0; i < last.size(); ++i) {
      candidate_point p;
      p.landmark = m.replacement(last.landmarks[i]);
      if (p.landmark != no_id)
        p.position = m.landmark_at(p.landmark).position;
      else if (last.has_depth(i))
        p.position = last.point_world(i);
      else
        continue;
      add_seen_point(list, project, rig_.scales, p, last.features.descriptors[i], last.features.keypoints[i], radius);
    }
    return list;
  }

  const camera_rig<Camera>& rig_;
  const options& options_;
};

}  // namespace orbis::slam::detail

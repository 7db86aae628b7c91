// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Where a frame was taken: by what the last one saw, by a keyframe, by the landmarks around.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/match.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/optimize/pnp.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/slam/detail/map/landmark_search.hpp>
#include <orbis/slam/detail/map/local_map.hpp>
#include <orbis/slam/detail/tracking/match_refinement.hpp>
#include <orbis/slam/frame.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/matchers.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

/// Finds poses of frames in a map. Each function leaves in the frame the pose it found and the landmarks that agree
/// with it, and returns how many matches agree, 0 if the pose cannot be told.
///
/// Source of the scheme and its figures: R. Mur-Artal, J. D. Tardos, "ORB-SLAM2: an open-source SLAM system for
/// monocular, stereo and RGB-D cameras", T-RO 33 (2017).
template <camera::camera_model Camera, tracking_matchers Matchers = orb_matchers>
class tracker {
 public:
  tracker(const optimize::reprojection<Camera>& model, const pyramid_scales& scales, const options& settings)
      : model_{model}, scales_{scales}, options_{settings} {}

  /// Looks for what the last frame saw, its landmarks and its other points with depth, from where the camera should be
  /// now. `last` has its pose as it is by now, and numbers of landmarks as they were.
  std::size_t by_motion(frame& f, const map& m, const frame& last, const se3& predicted) const {
    for (const double widening : {1.0, 2.0}) {
      f.T_world_camera = predicted;
      const features::camera_projection project{model_.camera, predicted};
      search_list list;
      for (std::size_t i = 0; i < last.size(); ++i) {
        candidate_point p{.landmark = m.became(last.landmarks[i])};
        if (p.landmark != no_id)
          p.position = m.landmark_at(p.landmark).position;
        else if (last.has_depth(i))
          p = {last.point_world(i), no_id};
        else
          continue;
        add_seen_point(list, project, scales_, p, last.features.descriptors[i], last.features.keypoints[i],
                       widening * options_.motion_radius);
      }
      const auto matches =
          Matchers::motion(features::feature_view<features::binary_descriptor<256>>{list.keypoints, list.descriptors},
                           f.features, list.windows, f.grid);
      if (matches.size() < options_.min_inliers) continue;
      if (const std::size_t inliers = refine_on_matches(f, list, matches, model_, scales_); inliers >= 10)
        return inliers;
    }
    return 0;
  }

  /// Matches a frame with a keyframe by appearance alone. @pre the keyframe is there
  std::size_t against(frame& f, const map& m, keyframe_id id) const {
    const keyframe& k = m.at(id);
    search_list list;
    std::vector<features::match> usable;
    std::vector<vec3> points;
    std::vector<vec2> pixels;
    for (const features::match& found : Matchers::appearance(k.features, f.features)) {
      candidate_point p{.landmark = k.landmarks[found.query]};
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
        std::span<const vec3>(points), std::span<const vec2>(pixels), model_.camera,
        {.threshold = 5.0, .max_iterations = 500, .min_inliers = enough, .seed = options_.seed});
    if (!pose) return 0;
    f.T_world_camera = pose->T_world_camera;
    const std::size_t inliers = refine_on_matches(f, list, usable, model_, scales_);
    return inliers >= enough ? inliers : 0;
  }

  /// Looks for the landmarks around in a frame whose pose is known roughly. `seen(id)` is called for the landmarks
  /// that the frame should show, `found(id)` for those that it does.
  template <class Seen, class Found>
  std::size_t on_local_map(frame& f, const map& m, keyframe_id reference, double radius, Seen&& seen,
                           Found&& found) const {
    const features::camera_projection project{model_.camera, f.T_world_camera};
    const features::projection_rule rule = rule_of(scales_, radius);
    search_list list;
    for (const landmark_id id : local_landmarks(m, f, reference, options_.local_keyframes))
      if (add_landmark(list, project, rule, m.landmark_at(id), id)) seen(id);
    const auto matches = Matchers::landmarks(list.descriptors, f.features, list.windows, f.grid);
    const std::size_t inliers = refine_on_matches(f, list, matches, model_, scales_);
    for (const landmark_id l : f.landmarks)
      if (l != no_id) found(l);
    return inliers;
  }

 private:
  const optimize::reprojection<Camera>& model_;
  const pyramid_scales& scales_;
  const options& options_;
};

}  // namespace orbis::slam::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Refinement of a frame with a roughly known pose, using the landmarks around it, their patches, and depth.
#pragma once

#include <cassert>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/core/se3.hpp>
#include <orbis/slam/detail/map/point_observation.hpp>
#include <orbis/slam/detail/shutter/motion_refinement.hpp>
#include <orbis/slam/detail/shutter/row_times.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/measure.hpp>

namespace orbis::slam::detail {

/// Refines frames. `Context` is a `tracking_context`.
template <class Context>
class frame_refinement {
  using frame_type = typename Context::frame_type;
  using task = typename Context::task;

 public:
  explicit frame_refinement(Context& context) : c_{context} {}

  /// With a rolling shutter, reads the row measurements of a frame again and corrects its keypoints to the frame's
  /// time, based on the motion from the last frame to the frame's current pose.
  void correct_rows(const task& t) const {
    if (t.frame.shutter.is_global()) return;
    t.read_rows(t.frame.as_read, {t.frame.shutter, motion_between(c_.last, t.frame)});
    move_keypoints(t.frame);
  }
  /// With a rolling shutter, corrects the keypoints of a frame to the frame's time, based on the motion from the last
  /// frame to the frame's current pose.
  void move_keypoints(frame_type& f) const {
    if (!f.shutter.is_global()) move_to_frame_time(f, c_.rig, f.shutter, motion_between(c_.last, f));
  }

  /// Searches for the landmarks around the reference keyframe, within `radius` pixels of a keypoint's level, and for
  /// their patches. Refines the pose, and returns the number of landmarks that agree with it.
  std::size_t match_local_map(const task& t, double radius) {
    frame_type& f = t.frame;
    auto& m = t.map();
    const std::size_t inliers = c_.search.on_local_map(
        f, m, c_.reference.keyframe, radius, c_.moving,
        [&](landmark_id l) { t.is_frozen ? void() : m.count_visible(l); },
        [&](landmark_id l) { t.is_frozen ? void() : m.count_found(l); });
    if (inliers == 0 || !c_.patches.is_ready()) return inliers;
    const auto motion = c_.motion_to(f);
    if (motion && c_.first_patches && !t.is_frozen && m.has_keyframe(*c_.first_patches))
      c_.patches.set_first_motion(m, *std::exchange(c_.first_patches, std::nullopt), *motion);
    const auto left = c_.patches.refine(f, m, motion.value_or(zeros<vec6>()));
    if (left.value_or(0) != 0) c_.patches.update_deviation(f, m);
    return left.value_or(inliers);
  }

  /// Refines the pose of a frame from its observed landmarks and, if enabled, from depth; with a rolling shutter, also
  /// refines the twist and corrects the keypoints with it. `is_next`: true if the frame follows the last one.
  void refine_motion(const task& t, bool is_next) {
    frame_type& f = t.frame;
    const auto& m = t.map();
    const bool rolls = !f.shutter.is_global();
    const bool with_depth = c_.depth.find_surfaces(t.maps, f.T_world_camera) && c_.settings.depth_term.enabled;
    twist_prior prior;
    if (!f.as_read.empty() && is_next && f.timestamp > c_.last.timestamp)
      prior = twist_prior::after({c_.last.T_world_camera, c_.last.twist}, f.timestamp - c_.last.timestamp,
                                 c_.motion.is_known() && !c_.last.as_read.empty());
    const auto expected_twist = [&] {
      return prior.T_world_before ? prior.expected(f.T_world_camera.inverse()) : f.twist;
    };
    moving_pose refined{f.T_world_camera, rolls ? expected_twist() : vec6(zeros<vec6>())};
    const int rounds = with_depth ? 3 : !rolls ? 0 : f.shutter.is_depth_simultaneous() ? 1 : 2;
    c_.depth_quadratic.reset();
    if (!rolls && with_depth) find_row_observations(f, m, c_.rig, rows_);
    for (int round = 0; round != rounds; ++round) {
      if (rolls) {
        // Depth was read assuming the previous motion; only the last round reads that of keypoints without landmarks.
        if (round + 1 == rounds)
          t.read_rows(f.as_read, {f.shutter, refined.twist});
        else
          read_observed(t, {f.shutter, refined.twist});
        find_row_observations(f, m, c_.rig, rows_);
      }
      if (with_depth) c_.depth_quadratic = c_.depth.term_at(refined, f.shutter);
      refined = refine_moving_pose(rows_, c_.rig.model, refined, prior, with_depth ? 3 : 5,
                                   {.other = c_.depth_quadratic ? &*c_.depth_quadratic : nullptr, .moves = rolls});
      if (f.shutter.is_depth_early()) {
        early_depth_.update(rows_, c_.rig.model, refined, prior);
        refined.twist = early_depth_.between(prior, refined.twist);
      }
    }
    if (f.shutter.is_depth_early()) early_depth_.advance();
    f.T_world_camera = refined.T_world_camera;
    if (!rolls) {
      f.twist = expected_twist();
      return;
    }
    move_to_frame_time(f, c_.rig, f.shutter, refined.twist, [&](std::size_t i) { return landmark_depth(f, i, m); });
  }

  /// Removes the landmarks of a frame that disagree with its pose. Returns the number of remaining landmarks.
  std::size_t drop_disagreeing(const task& t) const {
    frame_type& f = t.frame;
    const se3 T_camera_world = f.T_world_camera.inverse();
    std::size_t left = 0;
    for (std::size_t i = 0; i != f.size(); ++i) {
      landmark_id& l = f.landmarks[i];
      if (l != no_id && !agrees(c_.rig, f, T_camera_world, i, t.map().landmark_at(l).position)) l = no_id;
      left += l != no_id;
    }
    return left;
  }

 private:
  /// Reads the row measurements of the keypoints that observe landmarks again. @pre `as_read` has all keypoints
  void read_observed(const task& t, const frame_motion& motion) {
    frame_type& f = t.frame;
    assert(f.as_read.size() == f.size());
    observed_.clear();
    for (std::size_t i = 0; i != f.size(); ++i)
      if (f.landmarks[i] != no_id) observed_.push_back(f.as_read[i]);
    t.read_rows(observed_, motion);
    auto read = observed_.begin();
    for (std::size_t i = 0; i != f.size(); ++i)
      if (f.landmarks[i] != no_id) f.as_read[i] = *read++;
  }

  Context& c_;
  early_depth_twist early_depth_;
  row_lanes rows_;                          ///< reused working memory
  std::vector<keypoint_as_read> observed_;  ///< reused working memory
};

}  // namespace orbis::slam::detail

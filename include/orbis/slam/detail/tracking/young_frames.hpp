// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The second localisation of the first frames of a map.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>

#include <orbis/camera/model.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/features/pyramid.hpp>
#include <orbis/slam/atlas.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/dynamics/moving_features.hpp>
#include <orbis/slam/detail/shutter/motion_refinement.hpp>
#include <orbis/slam/detail/shutter/row_times.hpp>
#include <orbis/slam/detail/tracking/frame_log.hpp>
#include <orbis/slam/detail/tracking/patch_tracker.hpp>
#include <orbis/slam/detail/tracking/tracker.hpp>
#include <orbis/slam/frame.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

/// Keeps the first frames of a map. A new map has few landmarks, and keyframes that have not yet been adjusted with
/// later ones; the frames between these keyframes would keep their initial pose errors in the trajectory. They are
/// therefore localised again after several more keyframes, using the motion between their neighbours. If the trajectory
/// is limited to fewer frames than are kept here, none is kept.
template <camera::camera_model Camera, feature_descriptor D, tracking_matchers<D> Matchers>
class young_frames {
 public:
  young_frames(const camera_rig<Camera>& rig, const options& settings, const tracker<Camera, D, Matchers>& track)
      : rig_{rig},
        options_{settings},
        tracker_{track},
        patches_{rig, settings.patches},
        nothing_moves_{rig, settings} {}

  young_frames(const young_frames&) = delete;  // it refers to members of its owner
  young_frames& operator=(const young_frames&) = delete;

  /// Starts to keep the frames of a new map.
  void begin_map(map_id map) {
    waiting_.clear();
    count_ = options_.trajectory_frames < most ? most : 0;  // the trajectory may forget them first
    map_ = map;
  }
  /// Forgets the waiting frames: the shutter has changed, and the next keyframes are made with the new one.
  void forget() { waiting_.clear(); }
  /// Counts a keyframe of a map.
  void count_keyframe(map_id map) { keyframes_ += map == map_; }

  /// Adds the last frame of the log, with its image, if it is one of the first frames of the map and not too many are
  /// waiting. `of_tracking`: the patch tracker that has the image of the frame, if there is one; `depth`: the depth
  /// term of its pose, if any.
  void add(const basic_frame<D>& f, const patch_tracker<Camera, D>& of_tracking,
           const std::optional<pose_quadratic>& depth, const frame_log& log) {
    const std::size_t number = log.end_number() - 1;
    if (count_ == most || !of_tracking.is_ready() || log.reference(number).map != map_) return;
    ++count_;
    const auto width = static_cast<std::size_t>(rig_.camera().width());
    if ((waiting_.size() + 1) * width * static_cast<std::size_t>(rig_.camera().height()) > most_pixels) return;
    const auto landmarks = std::count_if(f.landmarks.begin(), f.landmarks.end(), [](auto l) { return l != no_id; });
    waiting_.push_back({f, of_tracking.copy_image(), depth, number, keyframes_, static_cast<std::size_t>(landmarks)});
  }

  /// If enough keyframes have followed the oldest frame, localises it again in the current map, corrects its pose in
  /// the log, and forgets the frame; otherwise returns false. Takes a few milliseconds. `of_tracking`: the patch
  /// tracker from which the estimated errors are taken.
  bool localize_oldest(frame_log& log, const patch_tracker<Camera, D>& of_tracking, const basic_atlas<D>& maps) {
    if (waiting_.empty()) return false;
    young_frame& oldest = waiting_.front();
    if (oldest.keyframes + enough > keyframes_) return false;
    patches_.set_errors(of_tracking);
    if (const auto pose = localize(oldest, log, maps)) log.set_pose(oldest.number, *pose, maps);
    waiting_.pop_front();
    return true;
  }

 private:
  static constexpr std::size_t most = 100;                ///< maximum number of frames per map
  static constexpr std::size_t most_pixels = 20'000'000;  ///< maximum total number of pixels: 65 frames of 640x480
  static constexpr std::size_t enough = 5;                ///< required number of later keyframes

  struct young_frame {
    basic_frame<D> frame;
    image<std::uint8_t> grey;
    std::optional<pose_quadratic> depth;
    std::size_t number;     ///< index in the log
    std::size_t keyframes;  ///< number of keyframes created before the frame
    std::size_t landmarks;  ///< number of landmarks observed initially
  };

  /// Localises a frame again. Returns its new pose; empty on failure.
  std::optional<se3> localize(young_frame& young, const frame_log& log, const basic_atlas<D>& maps) {
    const auto pose = log.pose(young.number, maps);
    if (!pose) return std::nullopt;
    const map_keyframe before = log.reference(young.number), reference = maps.current(before);
    const basic_map<D>& m = maps.at(reference.map);
    const keyframe_id nearest = m.replacement(reference.keyframe);
    if (nearest == no_id) return std::nullopt;
    basic_frame<D>& f = young.frame;
    for (landmark_id& l : f.landmarks)
      if (l != no_id) l = m.replacement(maps.current(before.map, l));
    if (young.depth)
      young.depth->at.T_world_camera = *pose * f.T_world_camera.inverse() * young.depth->at.T_world_camera;
    f.T_world_camera = *pose;

    const auto motion = log.motion(young.number, maps);
    if (motion) move_to_frame_time(f, rig_, f.shutter, *motion, [&](std::size_t i) { return landmark_depth(f, i, m); });
    const auto ignore = [](landmark_id) {};
    const std::size_t least = std::max(options_.min_inliers, young.landmarks / 2);
    if (tracker_.on_local_map(f, m, nearest, options_.search_radius, nothing_moves_, ignore, ignore) < least)
      return std::nullopt;
    pyramid_.build(std::as_const(young.grey).view(), rig_.scales.levels(), rig_.scales.factor(), 1);
    patches_.set_image({&pyramid_});
    const auto left = patches_.refine(f, m, motion.value_or(f.twist), false);
    patches_.set_image({});
    if (left && *left < least) return std::nullopt;

    constexpr double deviation = 0.05;  // of the mean motion over two intervals, metres or radians per second
    const bool moves = motion && !f.shutter.is_global();
    find_row_observations(f, m, rig_, rows_);
    return refine_moving_pose(
               rows_, rig_.model, {f.T_world_camera, f.twist},
               {.twist_before = f.twist, .translation_deviation = deviation, .rotation_deviation = deviation}, 5,
               {.other = young.depth ? &*young.depth : nullptr, .moves = moves})
        .T_world_camera;
  }

  const camera_rig<Camera>& rig_;
  const options& options_;
  const tracker<Camera, D, Matchers>& tracker_;
  patch_tracker<Camera, D> patches_;
  moving_features<Camera, D, Matchers> nothing_moves_;
  std::deque<young_frame> waiting_;
  map_id map_ = no_id;        ///< the last map that was started
  std::size_t count_ = most;  ///< number of frames of that map so far
  std::size_t keyframes_ = 0;
  features::image_pyramid pyramid_;  ///< reused working memory
  row_lanes rows_;                   ///< reused working memory
};

}  // namespace orbis::slam::detail

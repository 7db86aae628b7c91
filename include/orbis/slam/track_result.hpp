// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The result of tracking a frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include <orbis/camera/shutter.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/slam/ids.hpp>

namespace orbis::slam {

enum class track_state {
  /// No map has been started: no frame so far had enough keypoints with depth or, without depth, no two frames gave an
  /// unambiguous reconstruction.
  not_started,
  tracking,    ///< the pose of the last frame is known
  lost,        ///< the pose of the last frame is not known
  relocalized  ///< the last frame was relocalised in a map
};

[[nodiscard]] constexpr std::string_view to_string(track_state state) noexcept {
  switch (state) {
    case track_state::not_started: return "not started";
    case track_state::tracking: return "tracking";
    case track_state::lost: return "lost";
    case track_state::relocalized: return "relocalized";
  }
  return "unknown";
}

/// Wall time of the stages, milliseconds.
struct track_timings {
  double features_ms = 0.0;  ///< feature extraction and depth
  double tracking_ms = 0.0;  ///< estimation of the pose
  double mapping_ms = 0.0;   ///< keyframe creation; without threads, all work of the back end
};

/// The result of tracking one frame.
struct track_result {
  track_state state = track_state::not_started;
  std::optional<se3> T_world_camera;    ///< the pose, in the world frame of `map`; empty if not tracked
  map_id map = 0;                       ///< the active map
  std::size_t inliers = 0;              ///< number of landmarks that agree with the pose; small if depth determines it
  std::optional<keyframe_id> keyframe;  ///< the keyframe created from the frame, if any
  /// Twist of the camera in its own frame during the read-out of a rolling shutter, per second, translation first. Zero
  /// if unknown. Argument of `camera::shutter_correction`.
  vec6 twist = zeros<vec6>();
  /// Shutter assumed for the frame, given or estimated; its depth delay is that of this frame.
  camera::shutter shutter{};
  track_timings timings;
  [[nodiscard]] bool tracked() const noexcept { return T_world_camera.has_value(); }
};

/// A feature of a tracked frame.
struct tracked_feature {
  float x = 0.0F, y = 0.0F;  ///< pixels
  bool tracked = false;      ///< observes a previously known landmark, in agreement with the pose
  bool moving = false;       ///< is on a moving object; excluded from tracking and mapping (`moving_options`)
};

/// Tracking details of a frame, for display or logging.
struct tracked_frame {
  /// The keyframe that the frame's pose follows. `atlas::current` returns its current id; with
  /// `options::trajectory_frames` it may be forgotten later (`basic_map::remembers`).
  map_keyframe reference;
  se3 T_reference_camera;  ///< translation divided by `basic_map::scale(reference)`, which is 1 with depth
  std::vector<tracked_feature> features;
  vec6 twist = zeros<vec6>();  ///< see `track_result::twist`
};

/// Counts over all frames so far. Frames before the start of the first map are neither tracked nor lost.
struct track_counters {
  std::size_t frames = 0;
  std::size_t tracked = 0;  ///< including relocalised frames and the first of two frames that start a map
  std::size_t lost = 0;
  std::size_t relocalized = 0;
  std::size_t loops_closed = 0;
  std::size_t maps_merged = 0;
  std::size_t keyframes_culled = 0;
};

/// The pose of a keyframe.
struct keyframe_pose {
  double timestamp = 0.0;  ///< seconds
  se3 T_world_camera;
  std::size_t frame = 0;  ///< index of the frame, from 0
};

/// Revision of the keyframes of the active map and their poses: it changes when a keyframe moves, is created or is
/// culled, and when another map becomes active. The default value differs from the revision of every map.
struct pose_revision {
  map_id map = no_id;
  std::uint64_t changes = 0;
  friend bool operator==(const pose_revision&, const pose_revision&) = default;
};

}  // namespace orbis::slam

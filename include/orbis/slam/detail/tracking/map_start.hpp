// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Initialisation of a map: from one frame with depth, or from two frames without.
#pragma once

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/core/se3.hpp>
#include <orbis/slam/detail/mapping/keyframe_insertion.hpp>
#include <orbis/slam/detail/tracking/monocular_start.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/measure.hpp>
#include <orbis/slam/track_result.hpp>

namespace orbis::slam::detail {

/// Initialises maps. `Context` is a `tracking_context`.
template <class Context>
class map_start {
  using frame_type = typename Context::frame_type;
  using descriptor = typename Context::descriptor_type;
  using task = typename Context::task;

 public:
  explicit map_start(Context& context)
      : c_{context}, pair_{context.rig, context.settings.start, context.settings.seed} {}

  /// The first of the two keyframes that start a map without depth.
  struct first_frame {
    map_keyframe keyframe;
    double timestamp;  ///< seconds
  };
  /// The first keyframe of the map started by the last frame; empty if that frame started no map, or is itself the
  /// first keyframe.
  [[nodiscard]] const std::optional<first_frame>& first() const noexcept { return first_; }
  /// Returns true if the last frame started a map.
  [[nodiscard]] bool begins_map() const noexcept { return begins_map_; }

  /// Prepares for the next frame.
  void next_frame() {
    begins_map_ = false;
    first_.reset();
  }
  /// Discards the candidates for the first frame of a map without depth. Call after a frame has been tracked.
  void forget_candidates() { pair_.reset(); }

  /// Starts a map from a frame if its measurements are sufficient; without depth, together with an earlier frame. The
  /// map becomes active. Returns the number of points from which the map starts; 0 if no map was started.
  std::size_t begin(const task& t) {
    frame_type& f = t.frame;
    std::size_t points = start_points(f, c_.settings);
    if (points == 0) return 0;
    std::optional<monocular_start_result<descriptor>> start;
    if (!c_.rig.scale_is_known) {
      start = pair_.process(f);
      if (!start) return 0;
      points = start->points.size();
    }
    enter_new_map(t);
    f.landmarks.assign(f.size(), no_id);  // these are from searches in other maps
    f.spreads.clear();
    f.T_world_camera =
        c_.settings.find_initial_pose ? c_.settings.find_initial_pose() : c_.settings.initial_pose.value_or(se3{});
    if (start) add_first(*std::move(start), t);
    begins_map_ = true;
    c_.state = track_state::tracking;
    return points;
  }
  /// Adds the landmarks that both frames observe. The second frame must already be a keyframe.
  void add_landmarks(basic_map<descriptor>& m, keyframe_id second) {
    for (const start_point& p : std::exchange(points_, {})) {
      const landmark_id l = m.add_landmark(second, p.second, p.position);
      m.add_observation(l, first_->keyframe.keyframe, p.first);
      m.update_landmark(l);
    }
  }

 private:
  /// Creates and activates a map; if no map has been started yet, the active map is used instead. If the previous map
  /// has few keyframes, it is passed to `drop_map`.
  void enter_new_map(const task& t) {
    if (c_.state == track_state::not_started) return;
    const map_id before = t.maps.active_id();
    t.maps.create();
    if (t.maps.at(before).keyframes().size() < c_.settings.recovery.min_map_keyframes) t.drop_map(before);
    c_.last = {};
    c_.motion.reset();
  }
  /// Adds the first of the two frames that start a map, and sets the pose of the second.
  void add_first(monocular_start_result<descriptor> start, const task& t) {
    frame_type& f = t.frame;
    // `find_initial_pose` returns the pose of `f`; `initial_pose` is that of the first frame.
    const se3 T_world_first =
        c_.settings.find_initial_pose ? f.T_world_camera * start.T_first_second.inverse() : se3(f.T_world_camera);
    f.T_world_camera = T_world_first * start.T_first_second;
    frame_type& first = start.first;
    first.T_world_camera = T_world_first;
    first.landmarks.assign(first.size(), no_id);
    const double timestamp = first.timestamp;
    c_.reference = {t.maps.active_id(), insert_keyframe(t.map(), std::move(first), c_.settings)};
    first_ = {c_.reference, timestamp};
    points_ = std::move(start.points);
    for (start_point& p : points_) p.position = T_world_first * p.position;
  }

  Context& c_;
  monocular_start<typename Context::camera_type, descriptor> pair_;
  bool begins_map_ = false;
  std::optional<first_frame> first_;
  std::vector<start_point> points_;  ///< points that both frames observe, until the second one is a keyframe
};

}  // namespace orbis::slam::detail

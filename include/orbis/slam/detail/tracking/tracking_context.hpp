// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The data shared by the steps of tracking.
#pragma once

#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/slam/atlas.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/depth/depth_tracker.hpp>
#include <orbis/slam/detail/dynamics/moving_features.hpp>
#include <orbis/slam/detail/shutter/motion_refinement.hpp>
#include <orbis/slam/detail/shutter/shutter_observer.hpp>
#include <orbis/slam/detail/tracking/frame_log.hpp>
#include <orbis/slam/detail/tracking/motion_model.hpp>
#include <orbis/slam/detail/tracking/patch_tracker.hpp>
#include <orbis/slam/detail/tracking/tracker.hpp>
#include <orbis/slam/frame.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/matchers.hpp>
#include <orbis/slam/measure.hpp>
#include <orbis/slam/options.hpp>
#include <orbis/slam/track_result.hpp>

namespace orbis::slam::detail {

/// A frame to localise, with the maps and the functions that this requires. The frame is modified and finally moved
/// from. All functions except `localized` must be set.
template <feature_descriptor D>
struct tracking_task {
  basic_frame<D>& frame;
  basic_atlas<D>& maps;
  bool is_frozen = false;  ///< true if the maps are not changed and no map is started
  /// Returns true if the back end accepts another keyframe of an existing map.
  std::function<bool()> has_room;
  /// Reads the depth image of the frame; while the shutter is estimated, also after the call.
  row_reader read_rows;
  /// Returns the ids of the `count` keyframes with the most similar appearance.
  std::function<std::vector<map_keyframe>(const decltype(basic_frame<D>::features)&, std::size_t count)> find_similar;
  /// Called for the previous map when a new one is started, if the previous map has few keyframes.
  std::function<void(map_id)> drop_map;
  /// Called when the pose has been estimated, before a keyframe is created.
  std::function<void()> localized;

  [[nodiscard]] basic_map<D>& map() const { return maps.active(); }
};

/// A pose relative to a keyframe; it moves with the keyframe.
struct anchored_pose {
  map_keyframe reference;
  se3 T_reference_camera;  ///< translation divided by the scale of the reference
  double scale = 1.0;      ///< scale of the reference when the pose was last used
};

/// The components of tracking and its state between frames: the last frame, its reference keyframe and the motion.
template <camera::camera_model Camera, feature_descriptor D, tracking_matchers<D> Matchers>
struct tracking_context {
  using camera_type = Camera;
  using descriptor_type = D;
  using frame_type = basic_frame<D>;
  using atlas_type = basic_atlas<D>;
  using task = tracking_task<D>;

  tracking_context(const camera_rig<Camera>& used, const options& given)
      : rig{used},
        settings{given},
        search{used, given},
        moving{used, given},
        depth{used, given.depth_term},
        patches{used, given.patches} {
    if (given.estimates_shutter) observer.emplace(given.earlier_estimate);
  }
  tracking_context(const tracking_context&) = delete;  // its members refer to each other
  tracking_context& operator=(const tracking_context&) = delete;

  const camera_rig<Camera>& rig;
  const options& settings;
  tracker<Camera, D, Matchers> search;
  moving_features<Camera, D, Matchers> moving;
  depth_tracker<Camera> depth;
  patch_tracker<Camera, D> patches;
  std::optional<shutter_observer> observer;  ///< empty unless the shutter is estimated

  track_state state = track_state::not_started;
  map_keyframe reference;  ///< the keyframe with which the current frame shares the most landmarks
  frame_type last;         ///< the last frame that was tracked
  motion_model motion;
  std::optional<keyframe_id> first_patches;       ///< the first keyframe of the map, as long as its motion is unknown
  std::optional<pose_quadratic> depth_quadratic;  ///< the depth term of the last refined frame

  [[nodiscard]] bool is_tracking() const noexcept {
    return state == track_state::tracking || state == track_state::relocalized;
  }
  /// The pose of the last frame.
  [[nodiscard]] const anchored_pose& anchor() const noexcept { return anchor_; }
  /// The map that contains the last frame; poses can be predicted from that frame only in this map.
  [[nodiscard]] map_id last_map(const atlas_type& maps) const { return maps.current(anchor_.reference).map; }
  /// The current pose of the last frame; it follows later corrections of its keyframe.
  [[nodiscard]] se3 last_pose(const atlas_type& maps) const {
    return frame_log::pose({last.timestamp, anchor_.reference, anchor_.T_reference_camera}, maps)
        .value_or(last.T_world_camera);
  }

  /// Predicts `T_world_camera` of a frame with the constant-velocity model.
  [[nodiscard]] se3 predict(const frame_type& f) const {
    return motion.predict({last.timestamp, last.T_world_camera}, f.timestamp);
  }
  /// Returns true if the frame before `f` was also tracked, so that their poses determine the camera motion.
  [[nodiscard]] bool follows_last(const frame_type& f) const noexcept {
    return state == track_state::tracking && last.size() != 0 && last.index + 1 == f.index;
  }
  /// Returns the twist of the camera at a frame, per second: the mean since the last frame, extrapolated by half of its
  /// change (see `twist_prior`). Empty if the last frame is not the preceding one, or the pose has jumped.
  [[nodiscard]] std::optional<vec6> motion_to(const frame_type& f) const {
    constexpr double fastest = 5.0, fastest_turn = 10.0;  // metres and radians per second
    if (!follows_last(f)) return std::nullopt;
    const vec6 mean = motion_between(last, f);
    if (!(norm(head<3>(mean)) < fastest && norm(tail<3>(mean)) < fastest_turn)) return std::nullopt;
    return motion.is_known() ? vec6(mean + 0.5 * (mean - motion.twist())) : mean;
  }

  /// Brings the ids and poses kept from the last frame up to date with the maps: since then, maps may have been merged
  /// or corrected, and keyframes culled.
  void follow_maps(const atlas_type& maps) {
    const map_keyframe now = maps.current(reference);
    if (now.map != reference.map)
      for (landmark_id& l : last.landmarks)
        if (l != no_id) l = maps.current(reference.map, l);
    reference = now;
    if (!maps.contains(now.map)) return;
    last.T_world_camera = last_pose(maps);
    const map_keyframe k = maps.current(anchor_.reference);
    if (k.map == now.map && maps.at(now.map).remembers(k.keyframe)) {
      const double scale = maps.at(now.map).scale(k.keyframe);
      const double grown = scale / std::exchange(anchor_.scale, scale);
      motion.scale_by(grown);
      set_block(last.twist, 0, 0, head<3>(last.twist) * grown);
    }
    reference.keyframe = maps.at(now.map).replacement(now.keyframe);
  }

  /// Returns the pose of a tracked frame relative to its reference keyframe.
  [[nodiscard]] anchored_pose refer(const frame_type& f, const atlas_type& maps) const {
    const basic_keyframe<D>& k = maps.active().at(reference.keyframe);
    return {reference, scaled(k.T_world_camera.inverse() * f.T_world_camera, 1.0 / k.scale), k.scale};
  }
  /// Makes a tracked frame the last one, and updates the motion, which is unknown unless the preceding frame was also
  /// tracked.
  void set_last(frame_type&& f, const anchored_pose& anchor) {
    if (follows_last(f)) motion.set({last.timestamp, last.T_world_camera}, {f.timestamp, f.T_world_camera});
    anchor_ = anchor;
    last = std::move(f);
  }

 private:
  anchored_pose anchor_;  ///< pose of `last`
};

}  // namespace orbis::slam::detail

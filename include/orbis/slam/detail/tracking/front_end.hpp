// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The front end: localises frames in the active map and creates keyframes.
#pragma once

#include <cassert>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/camera/shutter.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/slam/atlas.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/map/local_map.hpp>
#include <orbis/slam/detail/mapping/keyframe_insertion.hpp>
#include <orbis/slam/detail/shutter/row_times.hpp>
#include <orbis/slam/detail/tracking/frame_log.hpp>
#include <orbis/slam/detail/tracking/frame_refinement.hpp>
#include <orbis/slam/detail/tracking/keyframe_decision.hpp>
#include <orbis/slam/detail/tracking/map_start.hpp>
#include <orbis/slam/detail/tracking/recovery.hpp>
#include <orbis/slam/detail/tracking/tracking_context.hpp>
#include <orbis/slam/detail/tracking/young_frames.hpp>
#include <orbis/slam/frame.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/matchers.hpp>
#include <orbis/slam/measure.hpp>
#include <orbis/slam/options.hpp>
#include <orbis/slam/shutter_estimate.hpp>
#include <orbis/slam/track_result.hpp>

namespace orbis::slam::detail {

/// Tracks the frames of one camera. It takes no lock: the caller must ensure that the maps are not changed during a
/// call, and that `improve_frame`, which the mapping thread calls, runs neither during `track` nor while the log is
/// read.
///
/// Follows R. Mur-Artal, J. D. Tardos, "ORB-SLAM2", T-RO 33 (2017), section III.
template <camera::camera_model Camera, feature_descriptor D, tracking_matchers<D> Matchers>
class front_end {
  using context = tracking_context<Camera, D, Matchers>;

 public:
  using frame_type = basic_frame<D>;
  using atlas_type = basic_atlas<D>;
  using task = tracking_task<D>;
  /// Minimum number of erased keyframes whose poses can still be queried: users may have received their ids from an
  /// event.
  static constexpr std::size_t latest_erased = 1024;

  /// The outcome of tracking a frame.
  struct outcome {
    /// Number of landmarks that agree with the pose (if the frame starts a map: the number of points it starts with); 0
    /// if the frame has no pose or, with `is_tracking()`, if only depth determines the pose.
    std::size_t inliers = 0;
    std::optional<map_keyframe> made;   ///< the keyframe created from the frame, if any
    std::optional<map_keyframe> first;  ///< the preceding keyframe, created from an earlier frame to start a map
  };

  front_end(const camera_rig<Camera>& rig, const options& settings)
      : context_{rig, settings},
        young_{rig, settings, context_.search},
        shutter_{settings.shutter},
        log_{settings.trajectory_frames} {}

  /// The current shutter, given or estimated.
  [[nodiscard]] const camera::shutter& shutter() const noexcept { return shutter_; }
  /// The estimate of the shutter; empty unless it is estimated.
  [[nodiscard]] std::optional<shutter_estimate> estimated_shutter() const {
    return context_.observer ? std::optional{context_.observer->estimate()} : std::nullopt;
  }
  /// Sets the shutter of a frame, and keeps the frame's keypoints as read if they need correction.
  /// @pre `f.shutter.depth_delay` is the difference between the timestamps of the frame's images
  void set_shutter(frame_type& f) const {
    const double by_clock = f.shutter.depth_delay;
    f.shutter = shutter_;
    f.shutter.depth_delay += by_clock;
    if (context_.observer || !f.shutter.is_global()) keep_as_read(f);
  }

  /// The depth tracker. It must receive the depth image of the next frame before the frame is tracked.
  [[nodiscard]] depth_tracker<Camera>& depth() noexcept { return context_.depth; }
  /// The patch tracker. It must receive the image of the next frame before the frame is tracked.
  [[nodiscard]] patch_tracker<Camera, D>& patches() noexcept { return context_.patches; }

  [[nodiscard]] track_state state() const noexcept { return context_.state; }
  [[nodiscard]] bool is_tracking() const noexcept { return context_.is_tracking(); }
  /// Counts over all frames; the counters of mapping are not set.
  [[nodiscard]] const track_counters& counters() const noexcept { return counters_; }
  /// The log of tracked frames: at most the latest `options::trajectory_frames`.
  [[nodiscard]] const frame_log& log() const noexcept { return log_; }
  [[nodiscard]] double last_timestamp() const noexcept { return context_.last.timestamp; }
  /// The current pose of the last tracked frame; it follows later corrections of its keyframe.
  [[nodiscard]] se3 last_pose(const atlas_type& maps) const { return context_.last_pose(maps); }
  /// The twist during the read-out of the last tracked frame; zero with a global shutter.
  [[nodiscard]] vec6 last_twist() const {
    return last_shutter().is_global() ? vec6(zeros<vec6>()) : context_.last.twist;
  }
  /// The shutter assumed for the last tracked frame.
  [[nodiscard]] const camera::shutter& last_shutter() const { return context_.last.shutter; }

  /// Returns the last tracked frame with its features. For the tracking thread only; does not read the maps.
  /// O(features).
  [[nodiscard]] tracked_frame last_frame() const {
    const frame_type& last = context_.last;
    tracked_frame shown{context_.anchor().reference, context_.anchor().T_reference_camera, {}, last_twist()};
    shown.features.reserve(last.size());
    for (std::size_t i = 0; i != last.size(); ++i) {
      const landmark_id l = last.landmarks[i];
      const auto& at = last.features.keypoints[i];
      const bool moved = !last.as_read.empty();  // report the positions in the image
      shown.features.push_back(
          {moved ? last.as_read[i].x : at.x, moved ? last.as_read[i].y : at.y, l != no_id && l < first_new_, false});
    }
    for (const vec2& at : context_.moving.pixels())
      shown.features.push_back({static_cast<float>(at.x()), static_cast<float>(at.y()), false, true});
    return shown;
  }

  /// Records that another map has become active: the camera is relocalised in it.
  void set_lost() {
    context_.state = track_state::lost;
    lost_since_.reset();
  }

  /// Localises a frame, creates a keyframe from it if necessary, and keeps it for the next frame and in the log.
  outcome track(const task& t) {
    assert(t.has_room && t.read_rows && t.find_similar && t.drop_map);
    context_.follow_maps(t.maps);
    start_.next_frame();
    first_new_ = no_id;
    outcome result{localize(t), {}, {}};
    if (t.localized) t.localized();
    if (is_tracking()) {
      if (!t.map().keyframes().empty())
        context_.reference = {t.maps.active_id(), most_shared(t.map(), t.frame, context_.reference.keyframe)};
      if (needs_keyframe(t, result.inliers)) result.made = make_keyframe(t);
    }
    if (start_.first()) result.first = start_.first()->keyframe;
    finish(t, result.made);
    if (!t.is_frozen) forget_erased(t.maps);
    return result;
  }

  /// Localises again the oldest waiting frame of a young map. Returns false if no frame is due. Takes a few
  /// milliseconds.
  bool improve_frame(const atlas_type& maps) { return young_.localize_oldest(log_, context_.patches, maps); }

  /// If the trajectory is limited, makes the active map forget erased keyframes except the latest ones and the
  /// reference keyframes of the frames in the trajectory. O(1), except O(frames + n log n) for every thousandth erased
  /// keyframe, where n is the number of erased keyframes remembered.
  void forget_erased(atlas_type& maps) {
    if (context_.settings.trajectory_frames == std::numeric_limits<std::size_t>::max()) return;
    if (maps.active().content().erased.size() < most_erased_) return;
    std::vector<keyframe_id> keep = log_.references(maps, maps.active_id());
    for (const map_keyframe& k : {maps.current(context_.reference), maps.current(context_.anchor().reference)})
      if (k.map == maps.active_id()) keep.push_back(k.keyframe);
    maps.active().forget_erased(keep, latest_erased);
    most_erased_ = maps.active().content().erased.size() + latest_erased;
  }

 private:
  /// Estimates the pose of a frame and sets the state. Returns `outcome::inliers`.
  std::size_t localize(const task& t) {
    if (state() == track_state::not_started) return t.is_frozen ? 0 : begin_map(t);
    if (is_tracking())
      if (const std::size_t inliers = track_from_last(t); inliers > 0) return recovery_.recheck_with_depth(t, inliers);
    const auto aligned = recovery_.align_depth(t);
    if (aligned)
      if (const std::size_t inliers = recovery_.track_from_depth(t, *aligned); inliers > 0) return inliers;
    if (const std::size_t inliers = recovery_.relocalize(t); inliers > 0) return inliers;
    if (aligned && is_tracking() && recovery_.localize_by_depth(t, *aligned)) return 0;
    if (const std::size_t inliers = recovery_.search_in_place(t); inliers > 0) return inliers;
    if (is_tracking()) lost_since_ = last_timestamp();
    if (!lost_since_) lost_since_ = t.frame.timestamp;
    context_.state = track_state::lost;
    const options& o = context_.settings;
    // Finding two frames for a new map takes time: if the current map is small, the search begins immediately.
    const bool is_here = context_.last.size() != 0 && context_.last_map(t.maps) == t.maps.active_id();
    const bool at_once =
        is_here && !context_.rig.scale_is_known && t.map().keyframes().size() < o.recovery.min_map_keyframes;
    if (t.is_frozen || (!at_once && t.frame.timestamp - *lost_since_ < o.recovery.new_map_after)) return 0;
    return begin_map(t);
  }
  /// Tracks from the last frame or, if that fails, from the reference keyframe; refines the pose on the local map.
  std::size_t track_from_last(const task& t) {
    frame_type& f = t.frame;
    auto& moving = context_.moving;
    const se3 predicted = context_.predict(f);
    f.T_world_camera = predicted;
    refinement_.correct_rows(t);
    moving.set_last(context_.last.T_world_camera);
    moving.find(f);
    if (context_.search.by_motion(f, t.map(), context_.last, predicted, moving) == 0 &&
        context_.search.by_appearance(f, t.map(), context_.reference.keyframe) == 0)
      return 0;
    moving.spread(f);
    refinement_.move_keypoints(f);
    const std::size_t inliers = refinement_.match_local_map(t, context_.settings.search_radius);
    if (inliers < context_.settings.min_inliers) return 0;
    refinement_.refine_motion(t, true);
    moving.take_out(f);
    context_.state = track_state::tracking;
    return inliers;
  }
  std::size_t begin_map(const task& t) {
    const bool was_lost = state() == track_state::lost;
    const std::size_t points = start_.begin(t);
    if (const auto& first = start_.first()) {
      log_.add({first->timestamp, first->keyframe, se3{}});
      ++counters_.tracked;
      if (was_lost) --counters_.lost;
    }
    return points;
  }

  /// Returns true if a localised frame should become a keyframe. A frame localised by depth becomes one if landmarks
  /// have not localised the camera for some time and the frame could start a map.
  [[nodiscard]] bool needs_keyframe(const task& t, std::size_t inliers) const {
    if (start_.begins_map()) return true;
    if (t.is_frozen || !t.has_room()) return false;
    const options& o = context_.settings;
    if (t.frame.held_by_depth)
      return t.frame.timestamp - held_since_ >= o.keyframes.interval && start_points(t.frame, o) > 0;
    return is_keyframe_due(
        gather_evidence(t.map(), t.frame, context_.reference.keyframe, inliers, o, context_.rig.scale_is_known),
        o.keyframes);
  }
  /// Adds a frame to the active map as a keyframe, which becomes the reference.
  map_keyframe make_keyframe(const task& t) {
    frame_type& f = t.frame;
    basic_map<D>& m = t.map();
    first_new_ = m.landmark_end();
    const keyframe_id id = insert_keyframe(m, f, context_.settings);
    const auto motion = context_.motion_to(f);
    const bool is_first = context_.last.size() == 0;
    if (context_.patches.is_ready() && (motion || is_first))
      context_.patches.add_patches(m, id, f, motion.value_or(zeros<vec6>()));
    context_.first_patches = is_first ? std::optional{id} : std::nullopt;
    start_.add_landmarks(m, id);
    f.landmarks = m.at(id).landmarks;
    return context_.reference = {t.maps.active_id(), id};
  }
  /// Counts a frame and, if it was localised, keeps it. `made`: the keyframe created from the frame, if any.
  void finish(const task& t, const std::optional<map_keyframe>& made) {
    frame_type& f = t.frame;
    const atlas_type& maps = t.maps;
    const track_state state = context_.state;
    ++counters_.frames;
    counters_.tracked += is_tracking();
    counters_.relocalized += state == track_state::relocalized;
    counters_.lost += state == track_state::lost;
    context_.motion.reset();
    if (context_.observer) observe(t, made);
    if (!is_tracking()) return;
    start_.forget_candidates();
    const anchored_pose anchor = context_.refer(f, maps);
    log_.add({f.timestamp, anchor.reference, anchor.T_reference_camera});
    if (!f.held_by_depth || made) held_since_ = f.timestamp;
    if (made)
      context_.depth.keep(*made, se3{}, f.twist, f.shutter);
    else if (context_.depth.needs_surface(maps, f.T_world_camera))
      context_.depth.keep(anchor.reference, anchor.T_reference_camera, f.twist, f.shutter);
    if (start_.begins_map()) young_.begin_map(maps.active_id());
    if (made) young_.count_keyframe(made->map);
    const bool may_wait = !made && state == track_state::tracking && !f.held_by_depth;
    if (may_wait && context_.moving.size() == 0) young_.add(f, context_.patches, context_.depth_quadratic, log_);
    context_.set_last(std::move(f), anchor);
  }
  /// Passes a tracked frame to the shutter observer.
  void observe(const task& t, const std::optional<map_keyframe>& made) {
    if (!context_.follows_last(t.frame)) return context_.observer->interrupt();
    if (const auto changed = context_.observer->add(context_.last, t.frame, made, t.read_rows, t.maps.active_id(),
                                                    t.map(), context_.rig, shutter_)) {
      shutter_ = *changed;
      young_.forget();
    }
  }

  context context_;
  frame_refinement<context> refinement_{context_};
  recovery<context> recovery_{context_, refinement_};
  map_start<context> start_{context_};
  young_frames<Camera, D, Matchers> young_;
  camera::shutter shutter_;
  frame_log log_;
  track_counters counters_;
  double held_since_ = 0.0;           ///< time of the last frame localised by landmarks or made a keyframe, seconds
  std::optional<double> lost_since_;  ///< time since which the camera is lost; if empty, the next lost frame sets it
  landmark_id first_new_;             ///< the first landmark created from the last frame; `no_id`: none
  std::size_t most_erased_ = 2 * latest_erased;  ///< number of erased keyframes at which some are forgotten
};

}  // namespace orbis::slam::detail

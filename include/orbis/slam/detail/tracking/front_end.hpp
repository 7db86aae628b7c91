// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The front end: localises frames in the active map and decides on keyframes.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/slam/atlas.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/depth/depth_tracker.hpp>
#include <orbis/slam/detail/map/local_map.hpp>
#include <orbis/slam/detail/mapping/keyframe_insertion.hpp>
#include <orbis/slam/detail/shutter/motion_refinement.hpp>
#include <orbis/slam/detail/shutter/row_times.hpp>
#include <orbis/slam/detail/shutter/shutter_observer.hpp>
#include <orbis/slam/detail/tracking/frame_log.hpp>
#include <orbis/slam/detail/tracking/keyframe_decision.hpp>
#include <orbis/slam/detail/tracking/monocular_start.hpp>
#include <orbis/slam/detail/tracking/motion_model.hpp>
#include <orbis/slam/detail/tracking/patch_tracker.hpp>
#include <orbis/slam/detail/tracking/tracker.hpp>
#include <orbis/slam/detail/tracking/young_frames.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/matchers.hpp>
#include <orbis/slam/measure.hpp>
#include <orbis/slam/options.hpp>
#include <orbis/slam/track_result.hpp>

namespace orbis::slam::detail {

/// Tracks the frames of one camera. It takes no lock: the caller ensures that the maps are not changed during a call.
/// Call for each frame, in this order: `sync_with_map`, `localize`, `update_reference` and, if `needs_keyframe`,
/// `make_keyframe`, then `finish`.
///
/// Follows R. Mur-Artal, J. D. Tardos, "ORB-SLAM2", T-RO 33 (2017), section III.
template <camera::camera_model Camera, feature_descriptor D, tracking_matchers<D> Matchers>
class front_end {
 public:
  using frame_type = basic_frame<D>;
  using atlas_type = basic_atlas<D>;
  /// Sets the measurements of a rolling shutter's rows (`as_read`), given the motion.
  using row_follower = std::function<void(frame_type&, const frame_motion&)>;
  /// Returns the ids of the keyframes with the most similar appearance.
  using appearance_search =
      std::function<std::vector<map_keyframe>(const decltype(frame_type::features)&, std::size_t count)>;
  /// Minimum number of erased keyframes whose poses remain queryable: users may have received their ids from an event.
  static constexpr std::size_t latest_erased = 1024;
  /// Called for a map with few keyframes when another one becomes active.
  using map_drop = std::function<void(map_id)>;

  front_end(const camera_rig<Camera>& rig, const options& settings)
      : tracker_{rig, settings},
        moving_{rig, settings},
        depth_{rig, settings.depth_term},
        patches_{rig, settings.patches},
        young_{rig, settings, tracker_, patches_},
        start_{rig, settings.start, settings.seed},
        rig_{rig},
        options_{settings},
        shutter_{settings.shutter},
        log_{settings.trajectory_frames} {
    if (settings.estimates_shutter) observer_.emplace();
  }

  /// The current shutter, given or estimated.
  [[nodiscard]] const camera::shutter& shutter() const noexcept { return shutter_; }
  /// The estimate of the shutter; empty unless it is estimated.
  [[nodiscard]] std::optional<shutter_estimate> estimated_shutter() const {
    return observer_ ? std::optional{observer_->estimate()} : std::nullopt;
  }
  /// Sets the shutter of a frame, whose `shutter.depth_delay` is that by its clocks, and keeps its keypoints as read if
  /// they need a correction.
  void set_shutter(frame_type& f) const {
    const double by_clock = f.shutter.depth_delay;
    f.shutter = shutter_;
    f.shutter.depth_delay += by_clock;
    if (observer_ || !f.shutter.is_global()) keep_as_read(f);
  }

  /// The depth tracker. Pass it the depth image of the next frame before the frame is localised.
  [[nodiscard]] depth_tracker<Camera>& depth() noexcept { return depth_; }

  /// The patch tracker. Pass it the image of the next frame before the frame is localised.
  [[nodiscard]] patch_tracker<Camera, D>& patches() noexcept { return patches_; }

  [[nodiscard]] track_state state() const noexcept { return state_; }
  [[nodiscard]] bool is_tracking() const noexcept {
    return state_ == track_state::tracking || state_ == track_state::relocalized;
  }
  /// Counts over all frames; those of mapping are not set.
  [[nodiscard]] const track_counters& counters() const noexcept { return counters_; }
  /// The tracked frames, at most the latest `options::trajectory_frames`.
  [[nodiscard]] const frame_log& log() const noexcept { return log_; }
  [[nodiscard]] double last_timestamp() const noexcept { return last_.timestamp; }
  /// The current pose of the last tracked frame; it follows later corrections of its keyframe.
  [[nodiscard]] se3 last_pose(const atlas_type& maps) const {
    return frame_log::pose_of({last_.timestamp, last_reference_, T_reference_last_}, maps)
        .value_or(last_.T_world_camera);
  }
  /// The motion during read-out of the last tracked frame; zero with a global shutter.
  [[nodiscard]] vec6 last_twist() const { return last_.shutter.is_global() ? vec6(zeros<vec6>()) : last_.twist; }
  /// The shutter assumed for the last tracked frame.
  [[nodiscard]] const camera::shutter& last_shutter() const { return last_.shutter; }

  /// Returns the last tracked frame with its features. For the tracking thread; does not read the maps. O(features).
  [[nodiscard]] tracked_frame last_frame() const {
    tracked_frame shown{last_reference_, T_reference_last_, {}, last_twist()};
    shown.features.reserve(last_.size());
    for (std::size_t i = 0; i != last_.size(); ++i) {
      const landmark_id l = last_.landmarks[i];
      const auto& at = last_.features.keypoints[i];
      const bool moved = !last_.as_read.empty();  // at their positions in the image
      shown.features.push_back(
          {moved ? last_.as_read[i].x : at.x, moved ? last_.as_read[i].y : at.y, l != no_id && l < first_new_, false});
    }
    for (const vec2& at : moving_.pixels())
      shown.features.push_back({static_cast<float>(at.x()), static_cast<float>(at.y()), false, true});
    return shown;
  }

  /// Records that another map became active: the camera is relocalised in it.
  void set_lost() {
    state_ = track_state::lost;
    lost_since_.reset();
  }

  /// Updates ids and poses kept from the last frame to the state of the maps, which may have been merged, corrected and
  /// culled since.
  void sync_with_map(const atlas_type& maps) {
    const map_keyframe now = maps.current(reference_);
    if (now.map != reference_.map)
      for (landmark_id& l : last_.landmarks)
        if (l != no_id) l = maps.current(reference_.map, l);
    reference_ = now;
    if (!maps.contains(now.map)) return;
    last_.T_world_camera = last_pose(maps);
    const map_keyframe last = maps.current(last_reference_);
    if (last.map == now.map && maps.at(now.map).remembers(last.keyframe)) {
      const double scale = maps.at(now.map).scale_of(last.keyframe);
      const double grown = scale / std::exchange(last_scale_, scale);
      motion_.scale_by(grown);
      set_block(last_.twist, 0, 0, head<3>(last_.twist) * grown);
    }
    reference_.keyframe = maps.at(now.map).replacement_of(now.keyframe);
  }

  /// Estimates the pose of a frame and sets `state()`. Returns the number of landmarks that agree with the pose (of
  /// points with depth, if the frame begins a map); 0 if it has no pose, or, with `is_tracking()`, if only depth
  /// determines it. `is_frozen`: the maps are not changed, and no map is begun.
  std::size_t localize(frame_type& f, atlas_type& maps, bool is_frozen, const row_follower& follow_rows,
                       const appearance_search& similar, const map_drop& drop) {
    first_new_ = no_id;
    begins_map_ = false;
    first_keyframe_.reset();
    if (state_ == track_state::not_started) return is_frozen ? 0 : begin_map(f, maps, drop);
    if (is_tracking())
      if (const std::size_t inliers = track_from_last(f, maps, is_frozen, follow_rows); inliers > 0)
        return recheck_with_depth(f, maps, inliers, is_frozen, follow_rows);
    const auto aligned = align_depth(f, maps);
    if (aligned)
      if (const std::size_t inliers = track_from_depth(f, maps, *aligned, is_frozen, follow_rows); inliers > 0)
        return inliers;
    if (const std::size_t inliers = relocalize(f, maps, is_frozen, follow_rows, similar); inliers > 0) return inliers;
    if (aligned && is_tracking() && localize_by_depth(f, *aligned)) return 0;
    if (const std::size_t inliers = search_in_place(f, maps, is_frozen, follow_rows); inliers > 0) return inliers;
    if (is_tracking()) lost_since_ = last_.timestamp;
    if (!lost_since_) lost_since_ = f.timestamp;
    state_ = track_state::lost;
    // Finding two frames takes time: if little is lost, the search begins immediately.
    const bool is_here = last_.size() != 0 && maps.current(last_reference_).map == maps.active_id();
    const bool at_once =
        is_here && !rig_.scale_is_known && maps.active().keyframes().size() < options_.recovery.min_map_keyframes;
    if (is_frozen || (!at_once && f.timestamp - *lost_since_ < options_.recovery.new_map_after)) return 0;
    return begin_map(f, maps, drop);
  }

  /// Sets the reference to the keyframe that shares most landmarks with the frame.
  void update_reference(const frame_type& f, const atlas_type& maps) {
    if (!maps.active().keyframes().empty())
      reference_ = {maps.active_id(), most_shared(maps.active(), f, reference_.keyframe)};
  }
  /// Returns true if a localised frame should become a keyframe. A frame localised by depth becomes one if landmarks
  /// have not localised the camera for some time and a map could begin with the frame.
  [[nodiscard]] bool needs_keyframe(const frame_type& f, std::size_t inliers, const atlas_type& maps) const {
    if (begins_map()) return true;
    if (f.held_by_depth)
      return f.timestamp - held_since_ >= options_.keyframes.interval && start_points(f, options_) > 0;
    return is_keyframe_due(
        gather_evidence(maps.active(), f, reference_.keyframe, inliers, options_, rig_.scale_is_known),
        options_.keyframes);
  }
  /// Returns true if the last frame begins a map.
  [[nodiscard]] bool begins_map() const noexcept { return begins_map_; }
  /// The first of the two keyframes with which a map without depth begins; the last frame is the second.
  [[nodiscard]] const std::optional<map_keyframe>& first_keyframe() const noexcept { return first_keyframe_; }
  /// Adds a frame to the active map as a keyframe, which becomes the reference.
  map_keyframe make_keyframe(frame_type& f, atlas_type& maps) {
    basic_map<D>& m = maps.active();
    first_new_ = m.landmark_end();
    const keyframe_id id = insert_keyframe(m, f, options_);
    const auto motion = motion_to(f);
    const bool is_first = last_.size() == 0;
    if (patches_.is_ready() && (motion || is_first)) patches_.add_patches(m, id, f, motion.value_or(zeros<vec6>()));
    first_patches_ = is_first ? std::optional{id} : std::nullopt;
    for (const start_point& p : std::exchange(start_points_, {})) {
      const landmark_id l = m.add_landmark(id, p.second, p.position);
      m.add_observation(l, first_keyframe_->keyframe, p.first);
      m.update_landmark(l);
    }
    f.landmarks = m.at(id).landmarks;
    return reference_ = {maps.active_id(), id};
  }

  /// Counts a frame and, if it was localised, keeps it for the next prediction and in the log. `made`: the keyframe
  /// made from it.
  void finish(frame_type f, const atlas_type& maps, const std::optional<map_keyframe>& made) {
    ++counters_.frames;
    counters_.tracked += is_tracking();
    counters_.relocalized += state_ == track_state::relocalized;
    counters_.lost += state_ == track_state::lost;
    motion_.reset();
    if (observer_) observe(f, maps, made);
    if (!is_tracking()) return;
    if (last_.index + 1 == f.index && state_ == track_state::tracking && last_.size() != 0)
      motion_.set({last_.timestamp, last_.T_world_camera}, {f.timestamp, f.T_world_camera});
    last_reference_ = reference_;
    start_.reset();
    const basic_keyframe<D>& reference = maps.active().at(reference_.keyframe);
    last_scale_ = reference.scale;
    T_reference_last_ = scaled(reference.T_world_camera.inverse() * f.T_world_camera, 1.0 / reference.scale);
    log_.add({f.timestamp, last_reference_, T_reference_last_});
    if (!f.held_by_depth || made) held_since_ = f.timestamp;
    if (made)
      depth_.keep(*made, se3{}, f.twist, f.shutter);
    else if (depth_.needs_surface(maps, f.T_world_camera))
      depth_.keep(last_reference_, T_reference_last_, f.twist, f.shutter);
    if (begins_map()) young_.begin_map(maps.active_id());
    if (made) young_.count_keyframe(made->map);
    if (!made && state_ == track_state::tracking && !f.held_by_depth && moving_.size() == 0)
      young_.add(f, depth_quadratic_, log_);
    last_ = std::move(f);
    if (!made) young_.localize_oldest(log_, maps);
  }
  /// If the trajectory is limited, limits the erased keyframes that the active map remembers: to the reference
  /// keyframes of the frames in the trajectory, and the latest ones. O(1), except O(frames + n log n) for every
  /// thousandth erased keyframe, where n is the number remembered.
  void forget_erased(atlas_type& maps) {
    if (options_.trajectory_frames == std::numeric_limits<std::size_t>::max()) return;
    if (maps.active().content().erased.size() < most_erased_) return;
    std::vector<keyframe_id> keep = log_.references(maps, maps.active_id());
    for (const map_keyframe& k : {maps.current(reference_), maps.current(last_reference_)})
      if (k.map == maps.active_id()) keep.push_back(k.keyframe);
    maps.active().forget_erased(keep, latest_erased);
    most_erased_ = maps.active().content().erased.size() + latest_erased;
  }

 private:
  /// Begins a map with a frame, if its measurements allow it; without depth, together with an earlier frame. The map
  /// becomes active. Returns the number of its points.
  std::size_t begin_map(frame_type& f, atlas_type& maps, const map_drop& drop) {
    std::size_t points = start_points(f, options_);
    if (points == 0) return 0;
    std::optional<monocular_start_result<D>> start;
    if (!rig_.scale_is_known) {
      start = start_.process(f);
      if (!start) return 0;
      points = start->points.size();
    }
    enter_new_map(maps, drop);
    f.landmarks.assign(f.size(), no_id);  // they are from searches in other maps
    f.deviations.clear();
    f.T_world_camera =
        options_.find_initial_pose ? options_.find_initial_pose() : options_.initial_pose.value_or(se3{});
    if (start) add_start(*std::move(start), f, maps);
    begins_map_ = true;
    state_ = track_state::tracking;
    return points;
  }
  /// Activates a new map, unless the active one is new. If the previous map has few keyframes, it is passed to `drop`.
  void enter_new_map(atlas_type& maps, const map_drop& drop) {
    if (state_ == track_state::not_started) return;
    const map_id before = maps.active_id();
    maps.create();
    if (maps.at(before).keyframes().size() < options_.recovery.min_map_keyframes) drop(before);
    last_ = {};
    motion_.reset();
  }
  /// Adds the first of two frames with which a map begins; their points are added with `f`, the second one
  /// (`make_keyframe`).
  void add_start(monocular_start_result<D> start, frame_type& f, atlas_type& maps) {
    // `find_initial_pose` returns the pose of `f`; `initial_pose` is that of the first frame.
    const se3 T_world_first =
        options_.find_initial_pose ? f.T_world_camera * start.T_first_second.inverse() : se3(f.T_world_camera);
    f.T_world_camera = T_world_first * start.T_first_second;
    frame_type& first = start.first;
    first.T_world_camera = T_world_first;
    first.landmarks.assign(first.size(), no_id);
    const double timestamp = first.timestamp;
    first_keyframe_ = reference_ = {maps.active_id(), insert_keyframe(maps.active(), std::move(first), options_)};
    start_points_ = std::move(start.points);
    for (start_point& p : start_points_) p.position = T_world_first * p.position;
    log_.add({timestamp, reference_, se3{}});
    ++counters_.tracked;
    if (state_ == track_state::lost) --counters_.lost;
  }
  /// Tracks from the last frame, otherwise from the reference keyframe; refines the pose on the local map.
  std::size_t track_from_last(frame_type& f, atlas_type& maps, bool is_frozen, const row_follower& follow_rows) {
    const se3 predicted = motion_.predict({last_.timestamp, last_.T_world_camera}, f.timestamp);
    if (!f.shutter.is_global()) {
      f.T_world_camera = predicted;
      follow_rows(f, {f.shutter, motion_between(last_, f)});
      move_keypoints(f);
    }
    moving_.set_last(last_.T_world_camera);
    moving_.find(f);
    if (tracker_.by_motion(f, maps.active(), last_, predicted, moving_) == 0 &&
        tracker_.by_appearance(f, maps.active(), reference_.keyframe) == 0)
      return 0;
    moving_.spread(f);
    move_keypoints(f);
    const std::size_t inliers = track_local_map(f, maps.active(), options_.search_radius, is_frozen);
    if (inliers < options_.min_inliers) return 0;
    refine_motion(f, maps, true, follow_rows);
    moving_.take_out(f);
    state_ = track_state::tracking;
    return inliers;
  }
  /// Relocalises a frame from the reference and the keyframes with similar appearance, in any map.
  std::size_t relocalize(frame_type& f, atlas_type& maps, bool is_frozen, const row_follower& follow_rows,
                         const appearance_search& similar) {
    moving_.clear();
    std::vector<map_keyframe> candidates = similar(f.features, options_.recovery.candidates);
    if (reference_.map == maps.active_id() && maps.active().has_keyframe(reference_.keyframe) &&
        std::find(candidates.begin(), candidates.end(), reference_) == candidates.end())
      candidates.insert(candidates.begin(), reference_);
    const map_id active_before = maps.active_id();
    const map_keyframe reference_before = reference_;
    for (const map_keyframe& k : candidates) {
      if (tracker_.by_appearance(f, maps.at(k.map), k.keyframe) == 0) continue;
      maps.activate(k.map);
      reference_ = k;
      if (const std::size_t inliers = track_found(f, maps, is_frozen, follow_rows); inliers > 0) return inliers;
    }
    maps.activate(active_before);
    reference_ = reference_before;
    return 0;
  }
  /// Searches around the last tracked frame's pose, for a camera that has turned; requires a frame with enough points
  /// to begin a map.
  std::size_t search_in_place(frame_type& f, atlas_type& maps, bool is_frozen, const row_follower& follow_rows) {
    const bool is_here = last_.size() != 0 && reference_.map == maps.active_id() && maps.has(reference_);
    const bool is_recent = f.timestamp - last_.timestamp < options_.recovery.new_map_after;
    if (!is_here || (is_frozen && !is_recent) || start_points(f, options_) == 0) return 0;
    return tracker_.by_turning(f, maps.active(), last_) == 0 ? 0 : track_found(f, maps, is_frozen, follow_rows);
  }
  std::size_t track_local_map(frame_type& f, basic_map<D>& m, double radius, bool is_frozen) {
    const std::size_t inliers = tracker_.on_local_map(
        f, m, reference_.keyframe, radius, moving_, [&](landmark_id l) { is_frozen ? void() : m.count_visible(l); },
        [&](landmark_id l) { is_frozen ? void() : m.count_found(l); });
    if (inliers == 0 || !patches_.is_ready()) return inliers;
    const auto motion = motion_to(f);
    if (motion && first_patches_ && !is_frozen && m.has_keyframe(*first_patches_))
      patches_.set_first_motion(m, *std::exchange(first_patches_, std::nullopt), *motion);
    const auto left = patches_.refine(f, m, motion.value_or(zeros<vec6>()));
    if (left.value_or(0) != 0) patches_.update_deviation(f, m);
    return left.value_or(inliers);
  }
  /// The motion of a frame, per second: that since the last frame, extrapolated by half of its change (see
  /// `twist_prior`). Empty if the last frame is not the one before, or the pose has jumped.
  [[nodiscard]] std::optional<vec6> motion_to(const frame_type& f) const {
    constexpr double fastest = 5.0, fastest_turn = 10.0;  // metres and radians per second
    if (state_ != track_state::tracking || last_.size() == 0 || last_.index + 1 != f.index) return std::nullopt;
    const vec6 mean = motion_between(last_, f);
    if (!(norm(head<3>(mean)) < fastest && norm(tail<3>(mean)) < fastest_turn)) return std::nullopt;
    return motion_.is_known() ? vec6(mean + 0.5 * (mean - motion_.twist())) : mean;
  }

  /// Removes the landmarks of a frame that disagree with its pose. Returns the number left.
  std::size_t drop_disagreeing(frame_type& f, const basic_map<D>& m) const {
    const se3 T_camera_world = f.T_world_camera.inverse();
    std::size_t left = 0;
    for (std::size_t i = 0; i != f.size(); ++i) {
      landmark_id& l = f.landmarks[i];
      if (l != no_id && !agrees(rig_, f, T_camera_world, i, m.landmark_at(l).position)) l = no_id;
      left += l != no_id;
    }
    return left;
  }

  /// With a rolling shutter, moves the keypoints of a frame to its time, by the motion from the last frame to its
  /// current pose.
  void move_keypoints(frame_type& f) const {
    if (!f.shutter.is_global()) move_to_frame_time(f, rig_, f.shutter, motion_between(last_, f));
  }
  /// Passes a tracked frame to the shutter observer.
  void observe(const frame_type& f, const atlas_type& maps, const std::optional<map_keyframe>& made) {
    if (state_ != track_state::tracking || last_.index + 1 != f.index || last_.size() == 0)
      return observer_->interrupt();
    if (const auto changed = observer_->add(last_, f, made, maps.active(), rig_, shutter_)) shutter_ = *changed;
  }
  /// Refines a frame by its observed landmarks and, if enabled, by depth: the pose and, with a rolling shutter, the
  /// twist, by which the keypoints are then moved. `is_next`: the frame follows the last one.
  void refine_motion(frame_type& f, const atlas_type& maps, bool is_next, const row_follower& follow_rows) {
    const basic_map<D>& m = maps.active();
    const bool rolls = !f.shutter.is_global();
    const bool with_depth = depth_.find_surfaces(maps, f.T_world_camera) && options_.depth_term.enabled;
    twist_prior prior;
    if (!f.as_read.empty() && is_next && f.timestamp > last_.timestamp)
      prior = twist_prior::after({last_.T_world_camera, last_.twist}, f.timestamp - last_.timestamp,
                                 motion_.is_known() && !last_.as_read.empty());
    const auto expected_twist = [&] {
      return prior.T_world_before ? prior.expected(f.T_world_camera.inverse()) : f.twist;
    };
    moving_pose refined{f.T_world_camera, rolls ? expected_twist() : vec6(zeros<vec6>())};
    const int rounds = with_depth ? 3 : !rolls ? 0 : f.shutter.is_depth_simultaneous() ? 1 : 2;
    depth_quadratic_.reset();
    if (!rolls && with_depth) find_row_observations(f, m, rig_, rows_);
    for (int round = 0; round != rounds; ++round) {
      if (rolls) {
        follow_rows(f, {f.shutter, refined.twist});  // depth was read with the previous motion
        find_row_observations(f, m, rig_, rows_);
      }
      if (with_depth) depth_quadratic_ = depth_.term_at(refined, f.shutter);
      refined =
          refine_moving_pose(std::span<const row_observation>(rows_), rig_.model, refined, prior, with_depth ? 3 : 5,
                             {.other = depth_quadratic_ ? &*depth_quadratic_ : nullptr, .moves = rolls});
      if (f.shutter.is_depth_early()) {
        early_depth_.update(std::span<const row_observation>(rows_), rig_.model, refined, prior);
        refined.twist = early_depth_.between(prior, refined.twist);
      }
    }
    if (f.shutter.is_depth_early()) early_depth_.advance();
    f.T_world_camera = refined.T_world_camera;
    if (observer_) shutter_observer::set_changes(f, {f.shutter, rolls ? refined.twist : expected_twist()}, follow_rows);
    if (!rolls) {
      f.twist = expected_twist();
      return;
    }
    move_to_frame_time(f, rig_, f.shutter, refined.twist, [&](std::size_t i) { return landmark_depth(f, i, m); });
  }
  /// Refines a pose found by a search, in the active map around the reference, on the local map. Sets `state()` if the
  /// frame is relocalised.
  std::size_t track_found(frame_type& f, atlas_type& maps, bool is_frozen, const row_follower& follow_rows) {
    const std::size_t inliers = track_local_map(f, maps.active(), 3.0 * options_.search_radius, is_frozen);
    if (inliers < options_.recovery.min_inliers) return 0;
    refine_motion(f, maps, false, follow_rows);
    state_ = track_state::relocalized;
    return inliers;
  }
  /// Aligns the depth of a frame near the last one with the surfaces of keyframes.
  [[nodiscard]] std::optional<depth_alignment> align_depth(const frame_type& f, const atlas_type& maps) {
    constexpr double longest = 2.0;  // seconds
    const double interval = f.timestamp - last_.timestamp;
    if (!options_.depth_term.recovers || !(interval > 0.0 && interval < longest) ||
        maps.current(last_reference_).map != maps.active_id())
      return std::nullopt;
    const se3 predicted = motion_.predict({last_.timestamp, last_.T_world_camera}, f.timestamp);
    if (!depth_.find_surfaces(maps, predicted)) return std::nullopt;
    return depth_.align(search_starts(last_.T_world_camera, predicted, interval), f.shutter);
  }
  /// Tracks from a pose aligned by depth; refines it on the local map.
  std::size_t track_from_depth(frame_type& f, atlas_type& maps, const depth_alignment& aligned, bool is_frozen,
                               const row_follower& follow_rows) {
    f.T_world_camera = aligned.at.T_world_camera;
    moving_.clear();
    if (!f.shutter.is_global()) {
      follow_rows(f, {f.shutter, motion_between(last_, f)});
      move_keypoints(f);
    }
    if (tracker_.by_motion(f, maps.active(), last_, aligned.at.T_world_camera, moving_) == 0)
      f.T_world_camera = aligned.at.T_world_camera;
    const std::size_t inliers = track_local_map(f, maps.active(), 3.0 * options_.search_radius, is_frozen);
    const std::size_t few =
        options_.depth_term.min_inliers * static_cast<std::size_t>(std::max(1, 6 - aligned.determined));
    if (inliers < (is_tracking() ? std::min(few, options_.min_inliers) : options_.recovery.min_inliers)) return 0;
    refine_motion(f, maps, true, follow_rows);
    if (inliers < options_.min_inliers) {
      const std::size_t confirmed = drop_disagreeing(f, maps.active());
      if (confirmed < few || !depth_.has_surfaces() ||
          !depth_.supports_pose(depth_.agreement({f.T_world_camera, f.twist}, f.shutter)))
        return 0;
      f.held_by_depth = true;
    }
    state_ = is_tracking() ? track_state::tracking : track_state::relocalized;
    return inliers;
  }
  /// Checks a frame tracked by `inliers` landmarks against its depth. If the depth disagrees with the pose but agrees
  /// with another one, tracks from that pose. Returns the same as `localize`.
  std::size_t recheck_with_depth(frame_type& f, atlas_type& maps, std::size_t inliers, bool is_frozen,
                                 const row_follower& follow_rows) {
    // If something moves in the view, it causes the disagreement.
    if (!options_.depth_term.recovers || moving_.size() != 0 || !depth_.has_surfaces()) return inliers;
    const association seen = depth_.agreement({f.T_world_camera, f.twist}, f.shutter);
    if (seen.visible < options_.depth_term.min_points || seen.share() >= options_.depth_term.min_share) return inliers;
    const auto aligned = align_depth(f, maps);
    constexpr double better = 0.15;
    if (!aligned || aligned->seen.share() < seen.share() + better) return inliers;
    before_recheck_ = f;
    const auto quadratic_before = depth_quadratic_;
    if (const std::size_t there = track_from_depth(f, maps, *aligned, is_frozen, follow_rows); there > 0) return there;
    if (localize_by_depth(f, *aligned)) return 0;
    std::swap(f, before_recheck_);
    depth_quadratic_ = quadratic_before;
    return inliers;
  }
  /// Sets the pose from depth alone. Returns false if the alignment is uncertain, or leaves a direction of the pose
  /// free.
  bool localize_by_depth(frame_type& f, const depth_alignment& aligned) {
    if (!depth_.determines_pose(aligned)) return false;
    f.T_world_camera = aligned.at.T_world_camera;
    f.landmarks.assign(f.size(), no_id);
    f.deviations.clear();
    move_keypoints(f);
    state_ = track_state::tracking;
    f.held_by_depth = true;
    return true;
  }

  tracker<Camera, D, Matchers> tracker_;
  moving_features<Camera, D, Matchers> moving_;
  depth_tracker<Camera> depth_;
  patch_tracker<Camera, D> patches_;
  young_frames<Camera, D, Matchers> young_;
  monocular_start<Camera, D> start_;  ///< for maps without a known scale
  const camera_rig<Camera>& rig_;
  const options& options_;
  camera::shutter shutter_;
  std::optional<shutter_observer> observer_;
  std::vector<row_observation> rows_;              ///< reused working memory
  std::optional<pose_quadratic> depth_quadratic_;  ///< of the last refined frame
  early_depth_twist early_depth_;
  frame_type before_recheck_;  ///< reused working memory

  std::optional<keyframe_id> first_patches_;  ///< the first keyframe of the map, until its motion is known

  double held_since_ = 0.0;  ///< time of the last tracked frame whose pose was not determined by depth alone, seconds

  track_state state_ = track_state::not_started;
  bool begins_map_ = false;
  std::optional<map_keyframe> first_keyframe_;
  std::vector<start_point> start_points_;  ///< points of both frames, in the world, until the second is a keyframe
  std::optional<double> lost_since_;       ///< timestamp; empty: that of the next frame
  map_keyframe reference_;                 ///< the keyframe with which the current frame shares most landmarks
  frame_type last_;                        ///< the last frame that was tracked
  map_keyframe last_reference_;            ///< its reference ...
  double last_scale_ = 1.0;                ///< scale of that keyframe at the last update
  se3 T_reference_last_;   ///< ... and its pose relative to the reference, translation divided by its scale
  landmark_id first_new_;  ///< landmarks from this id on were made from the last frame; `no_id`: none
  motion_model motion_;
  track_counters counters_;
  frame_log log_;
  std::size_t most_erased_ = 2 * latest_erased;  ///< maximum number of erased keyframes before some are forgotten
};

}  // namespace orbis::slam::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Keyframe-based SLAM from an RGB-D camera.
///
/// @code
///   orbis::slam::rgbd_system slam{camera, orbis::slam::options{}};
///   for (const auto& frame : recording) slam.track(frame);
///   auto trajectory = slam.trajectory();
/// @endcode
///
/// The scheme is that of R. Mur-Artal, J. D. Tardos, "ORB-SLAM2: an open-source SLAM system for
/// monocular, stereo and RGB-D cameras", T-RO 33 (2017): predict by constant motion, find the local map's landmarks,
/// refine the pose, and make a keyframe where the view has changed; adjust the map around it; close loops where a
/// place is recognised. That a lost camera begins a new map, and maps become one where they meet, is after R. Elvira,
/// J. D. Tardos, J. M. M. Montiel, "ORBSLAM-Atlas", IROS 2019.
#pragma once

#include <algorithm>
#include <atomic>
#include <cassert>
#include <chrono>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/slam/atlas.hpp>
#include <orbis/slam/detail/loops/loop_closer.hpp>
#include <orbis/slam/detail/mapping/keyframe_insertion.hpp>
#include <orbis/slam/detail/mapping/local_mapper.hpp>
#include <orbis/slam/detail/system/shared_state.hpp>
#include <orbis/slam/detail/system/stopwatch.hpp>
#include <orbis/slam/detail/system/worker.hpp>
#include <orbis/slam/detail/tracking/keyframe_decision.hpp>
#include <orbis/slam/detail/tracking/tracker.hpp>
#include <orbis/slam/events.hpp>
#include <orbis/slam/map_file.hpp>
#include <orbis/slam/matchers.hpp>
#include <orbis/slam/options.hpp>
#include <orbis/slam/place_recognition.hpp>
#include <orbis/slam/track_result.hpp>

namespace orbis::slam {

/// Tracks the frames of one camera and builds a map of landmarks. Images are not kept; a caller who needs those of
/// keyframes keeps them when `track` says that a frame became one.
///
/// Without threads (the default) everything happens in `track`, and the same frames and options give the same bytes.
/// With them (`options.threads`) mapping, loop closing and global adjustment go on while frames are tracked. `track`
/// is for one thread; everything else may be called from any.
template <camera::camera_model Camera, feature_extractor Extractor = features::orb_extractor,
          tracking_matchers Matchers = orb_matchers, place_recognizer Places = bag_of_words_places>
class rgbd_system {
 public:
  explicit rgbd_system(Camera camera, const options& settings = {}) requires
      std::constructible_from<Extractor, const features::orb_options&> && std::default_initializable<Places>
      : rgbd_system(std::move(camera), settings, Extractor(settings.features)) {}
  rgbd_system(Camera camera, const options& settings, Extractor extractor, Places places = Places{})
      : options_{settings},
        extract_{std::move(extractor)},
        shared_{optimize::reprojection<Camera>{std::move(camera), settings.bf},
                {settings.features.levels, static_cast<double>(settings.features.scale_factor)},
                options_,
                std::move(places)},
        track_{shared_.model, shared_.scales, options_},
        mapper_{shared_},
        closer_{shared_} {
    options_.threads.max_waiting = std::max<std::size_t>(1, options_.threads.max_waiting);
    if (!options_.threads.enabled) return;
    global_worker_ = std::make_unique<detail::worker<map_id>>([this](map_id m) { closer_.adjust_globally(m); });
    loop_worker_ = std::make_unique<detail::worker<map_keyframe>>([this](map_keyframe k) {
      if (closer_.close(k)) global_worker_->push(shared_.locked([&] { return shared_.atlas.current(k).map; }));
    });
    map_worker_ = std::make_unique<detail::worker<map_keyframe>>([this](map_keyframe k) {
      mapper_.process(k, [this] { return map_worker_->waiting() != 0; });
      loop_worker_->push(k);
    });
  }
  rgbd_system(const rgbd_system&) = delete;
  rgbd_system& operator=(const rgbd_system&) = delete;
  /// Lets what is at hand end, and drops what waits.
  ~rgbd_system() {
    closer_.stop();
    // Each hands on to the next, and asks itself what waits: all are there until all have stopped.
    if (map_worker_) map_worker_->stop();
    if (loop_worker_) loop_worker_->stop();
    if (global_worker_) global_worker_->stop();
  }

  /// Who is told what happens. @pre no frame was tracked yet
  void listen(listeners all) { shared_.listening = std::move(all); }

  /// The next frame. Frames of another size than the camera's, or without a time, are counted as lost.
  track_result track(const camera::rgbd_frame& f) { return track(f.timestamp, f.color, f.depth_metres()); }

  /// The next frame, in place. @pre time stamps ascend
  template <camera::depth_source Depth>
  track_result track(double timestamp, image_view<const rgb8> color, const Depth& depth) {
    track_result result;
    detail::stopwatch clock;
    frame current = observe(timestamp, color, depth);
    clock.lap(result.timings.features_ms);
    if (map_worker_ && options_.threads.wait) map_worker_->wait_for_room(options_.threads.max_waiting);
    std::optional<map_keyframe> made;
    {
      const auto lock = shared_.lock();
      map_is_frozen_ = localization_only_;
      sync_with_map();
      result.inliers = find(current);
      clock.lap(result.timings.tracking_ms);
      if (result.inliers > 0 && needs_keyframe(current, result.inliers)) made = insert(current);
      remember(std::move(current));
    }
    if (made) dispatch_keyframe(*made);
    report(result, made);
    clock.lap(result.timings.mapping_ms);
    return result;
  }

  [[nodiscard]] track_state state() const {
    return shared_.locked([&] { return state_; });
  }
  [[nodiscard]] bool localizes_only() const noexcept { return localization_only_; }
  /// Whether the map is left as it is from the next frame on.
  void set_localization_only(bool on) noexcept { localization_only_ = on; }

  /// Returns when the threads have nothing to do.
  void wait() const {
    for (const auto* w : {&map_worker_, &loop_worker_})
      if (*w) (*w)->wait();
    if (global_worker_) global_worker_->wait();
  }

  /// Every frame that was tracked in the active map, where the keyframe it hangs on is now: later corrections of
  /// keyframes move it along.
  [[nodiscard]] orbis::trajectory trajectory() const {
    return shared_.locked([&] { return trajectory_in(shared_.atlas.active_id()); });
  }
  /// ... or in another one; empty, if there is none of this number.
  [[nodiscard]] orbis::trajectory trajectory(map_id map) const {
    return shared_.locked([&] { return trajectory_in(map); });
  }
  /// Time stamp, pose and frame index of each keyframe of the active map.
  [[nodiscard]] std::vector<keyframe_pose> keyframes() const {
    return shared_.locked([&] {
      std::vector<keyframe_pose> all;
      for (const keyframe& k : shared_.atlas.active().keyframes())
        all.push_back({k.timestamp, k.T_world_camera, k.index});
      return all;
    });
  }
  [[nodiscard]] orbis::trajectory keyframe_trajectory() const {
    orbis::trajectory all;
    for (const keyframe_pose& k : keyframes()) all.push_back({k.timestamp, k.T_world_camera});
    return all;
  }
  [[nodiscard]] std::size_t landmark_count() const {
    return shared_.locked([&] { return shared_.atlas.active().landmark_count(); });
  }
  [[nodiscard]] track_counters counters() const {
    return shared_.locked([&] {
      track_counters all = counters_;
      all.loops_closed = shared_.loops_closed;
      all.maps_merged = shared_.maps_merged;
      all.keyframes_culled = shared_.keyframes_culled;
      return all;
    });
  }
  /// The number of the active map, and of the one in which most frames were tracked.
  [[nodiscard]] map_id active_map() const {
    return shared_.locked([&] { return shared_.atlas.active_id(); });
  }
  [[nodiscard]] map_id largest_map() const {
    return shared_.locked([&] {
      std::map<map_id, std::size_t> frames;
      for (const tracked_frame& f : tracked_)
        if (const map_id m = shared_.atlas.current(f.reference).map; shared_.atlas.contains(m)) ++frames[m];
      const auto most = std::max_element(frames.begin(), frames.end(),
                                         [](const auto& a, const auto& b) { return a.second < b.second; });
      return most == frames.end() ? shared_.atlas.active_id() : most->first;
    });
  }
  /// Goes on in another map, of which the camera is looked for. False if there is none of this number.
  bool activate(map_id map) {
    return shared_.locked([&] {
      if (!shared_.atlas.contains(map)) return false;
      if (map != shared_.atlas.active_id()) {
        shared_.atlas.activate(map);
        state_ = track_state::lost;
        lost_since_.reset();
      }
      return true;
    });
  }

  /// Calls `read(const atlas&)` while nothing changes; what it takes, tracking waits. `read` must not call the system.
  template <std::invocable<const slam::atlas&> Read>
  decltype(auto) inspect(Read&& read) const {
    const auto lock = shared_.lock();
    return std::forward<Read>(read)(std::as_const(shared_.atlas));
  }
  /// The active map. @pre as long as it is looked at, no frame is tracked and the threads have nothing to do (`wait`)
  [[nodiscard]] const slam::map& map() const { return shared_.atlas.active(); }
  [[nodiscard]] const Camera& camera() const noexcept { return shared_.model.camera; }

  /// Writes the active map into a file. Errors: `write_failed`.
  [[nodiscard]] result<void> save_map(const std::filesystem::path& path) const {
    const std::string bytes = inspect([](const slam::atlas& all) { return map_bytes(all.active()); });
    return write_map_bytes(path, bytes);
  }
  /// Makes a map from a file the active one, in which the camera is looked for. The map so far stays, and becomes a
  /// part of the loaded one where it is recognised; without keyframes it goes. Errors: those of `read_map`,
  /// `unsupported` for a map of another image pyramid, `no_data` for one without keyframes.
  [[nodiscard]] result<void> load_map(const std::filesystem::path& path) {
    auto loaded = read_map(path);
    if (!loaded) return fail(loaded.error());
    const detail::map_content& content = loaded->content();
    if (content.levels != shared_.scales.levels() || !(content.scale_factor == shared_.scales.factor()))
      return fail(errc::unsupported, path.string(), "the map was made with another image pyramid");
    if (loaded->keyframes().empty()) return fail(errc::no_data, path.string(), "the map has no keyframes");
    std::vector<std::pair<keyframe_id, typename Places::signature>> bow_vectors;  // before tracking has to wait
    for (const keyframe& k : loaded->keyframes()) bow_vectors.emplace_back(k.id, shared_.places.describe(k.features));
    const auto lock = shared_.lock();
    const map_id before = shared_.atlas.active_id();
    const bool drop = shared_.atlas.active().keyframes().empty();
    const map_id id = shared_.atlas.create(*std::move(loaded));
    if (drop) shared_.atlas.remove(before);
    for (const auto& [k, seen] : bow_vectors) shared_.places.add({id, k}, seen);
    state_ = track_state::lost;
    lost_since_.reset();
    return {};
  }

 private:
  struct tracked_frame {
    double timestamp;
    map_keyframe reference;
    se3 T_reference_camera;
  };

  template <class Depth>
  [[nodiscard]] frame observe(double timestamp, image_view<const rgb8> color, const Depth& depth) {
    frame f;
    const auto fits = [&](const auto& image) {
      return image.width() == camera().width() && image.height() == camera().height();
    };
    const bool timed = std::isfinite(timestamp);
    if (timed && fits(color) && fits(depth)) f = make_frame(camera(), extract_, color, depth, options_);
    f.timestamp = timed ? timestamp : last_.timestamp;
    f.index = counters_.frames;
    return f;
  }

  [[nodiscard]] slam::map& active() { return shared_.atlas.active(); }

  /// Keyframes may have got other names since the last frame, or have been culled, and landmarks have been fused.
  void sync_with_map() {
    const map_keyframe now = shared_.atlas.current(reference_);
    if (now.map != reference_.map)
      for (landmark_id& l : last_.landmarks)
        if (l != no_id) l = shared_.atlas.current(reference_.map, l);
    reference_ = now;
    if (!shared_.atlas.contains(now.map)) return;
    last_.T_world_camera = last_pose();
    reference_.keyframe = shared_.atlas.at(now.map).heir(now.keyframe);
  }

  /// The pose of a frame: returns the number of landmarks that agree, 0 if it has none.
  std::size_t find(frame& f) {
    if (state_ == track_state::not_started) return start(f);
    if (const std::size_t inliers = locate(f); inliers > 0) return inliers;
    if (is_tracking()) lost_since_ = last_.timestamp;
    if (!lost_since_) lost_since_ = f.timestamp;
    state_ = track_state::lost;
    if (map_is_frozen_ || f.timestamp - *lost_since_ < options_.recovery.new_map_after) return 0;
    return start_new_map(f);
  }

  /// The first frame with enough depth defines the world.
  std::size_t start(frame& f) {
    if (map_is_frozen_) return 0;
    std::size_t with_depth = 0;
    for (std::size_t i = 0; i < f.size(); ++i) with_depth += f.has_depth(i);
    if (with_depth == 0 || with_depth < options_.min_start_points) return 0;
    f.T_world_camera = options_.initial_pose.value_or(se3{});
    state_ = track_state::tracking;
    return with_depth;
  }
  /// ... of a new map, where the camera has been lost for long.
  std::size_t start_new_map(frame& f) {
    const std::size_t with_depth = start(f);
    if (with_depth == 0) return 0;
    const map_id before = shared_.atlas.active_id();
    shared_.atlas.create();
    // Not while mapping works on it: then it stays, which does no harm.
    if (shared_.atlas.at(before).keyframes().size() < options_.recovery.min_map_keyframes)
      if (const auto edit = shared_.try_edit()) shared_.remove_map(before);
    last_ = {};
    velocity_.reset();
    return with_depth;
  }

  /// By motion, else against the reference keyframe, else by bow_vector; refined on the local map.
  std::size_t locate(frame& f) {
    if (is_tracking() && (track_.by_motion(f, active(), last_, predict(f.timestamp)) > 0 ||
                          track_.against(f, active(), reference_.keyframe) > 0)) {
      if (const std::size_t inliers = track_local_map(f, options_.search_radius); inliers >= options_.min_inliers) {
        state_ = track_state::tracking;
        return inliers;
      }
    }
    return relocalize(f);
  }
  [[nodiscard]] bool is_tracking() const {
    return state_ == track_state::tracking || state_ == track_state::relocalized;
  }

  std::size_t track_local_map(frame& f, double radius) {
    slam::map& m = active();
    const bool counts = !map_is_frozen_;
    return track_.on_local_map(
        f, m, reference_.keyframe, radius, [&](landmark_id l) { counts ? m.count_visible(l) : void(); },
        [&](landmark_id l) { counts ? m.count_found(l) : void(); });
  }

  /// Tries the last reference, and the keyframes that look most like the frame, in whichever map they are.
  std::size_t relocalize(frame& f) {
    std::vector<map_keyframe> candidates = shared_.similar(
        shared_.places.describe(f.features), options_.recovery.candidates, [](map_keyframe) { return false; });
    if (reference_.map == shared_.atlas.active_id() && active().has_keyframe(reference_.keyframe) &&
        std::find(candidates.begin(), candidates.end(), reference_) == candidates.end())
      candidates.insert(candidates.begin(), reference_);
    const map_id active_before = shared_.atlas.active_id();
    const map_keyframe reference_before = reference_;
    for (const map_keyframe& k : candidates) {
      if (track_.against(f, shared_.atlas.at(k.map), k.keyframe) == 0) continue;
      shared_.atlas.activate(k.map);
      reference_ = k;
      if (const std::size_t inliers = track_local_map(f, 3.0 * options_.search_radius);
          inliers >= options_.recovery.min_inliers) {
        state_ = track_state::relocalized;
        return inliers;
      }
    }
    shared_.atlas.activate(active_before);
    reference_ = reference_before;
    return 0;
  }

  [[nodiscard]] bool needs_keyframe(const frame& f, std::size_t inliers) {
    if (active().keyframes().empty()) return true;
    reference_ = {shared_.atlas.active_id(), detail::most_shared(active(), f, reference_.keyframe)};
    if (map_is_frozen_) return false;
    if (map_worker_ && map_worker_->waiting() >= options_.threads.max_waiting) return false;
    return detail::is_keyframe_due(detail::gather_evidence(active(), f, reference_.keyframe, inliers, options_),
                                   options_.keyframes);
  }

  map_keyframe insert(frame& f) {
    const keyframe_id id = detail::insert_keyframe(active(), f, options_);
    f.landmarks = active().at(id).landmarks;
    return reference_ = {shared_.atlas.active_id(), id};
  }

  /// Mapping and loop closing, now or by their threads.
  void dispatch_keyframe(map_keyframe k) {
    if (const auto& tell = shared_.listening.keyframe_made)  // its map may have become a part of another since
      tell(shared_.locked([&] { return shared_.event_of(shared_.atlas.current(k)); }));
    if (map_worker_) return map_worker_->push(k);
    mapper_.process(k, [] { return false; });
    if (closer_.close(k)) closer_.adjust_globally(shared_.atlas.current(k).map);
  }

  /// Where the last tracked frame is, now that its keyframe may have moved.
  [[nodiscard]] se3 last_pose() const {
    const map_keyframe k = shared_.atlas.current(last_reference_);
    return shared_.atlas.contains(k.map) && k.keyframe < shared_.atlas.at(k.map).keyframe_end()
               ? shared_.atlas.at(k.map).pose_of(k.keyframe) * T_reference_last_
               : last_.T_world_camera;
  }

  /// Where constant motion takes the camera.
  [[nodiscard]] se3 predict(double timestamp) const {
    if (!velocity_) return last_.T_world_camera;
    const double ratio = last_interval_ > 0.0 ? (timestamp - last_.timestamp) / last_interval_ : 1.0;
    return last_.T_world_camera * se3::exp(std::clamp(ratio, 0.0, 3.0) * *velocity_);
  }

  /// Keeps the frame for the next prediction, and its place in the trajectory.
  void remember(frame f) {
    ++counters_.frames;
    counters_.tracked += is_tracking();
    counters_.relocalized += state_ == track_state::relocalized;
    counters_.lost += state_ == track_state::lost;
    velocity_.reset();
    if (!is_tracking()) return;
    if (last_.index + 1 == f.index && state_ == track_state::tracking && last_.size() != 0) {
      velocity_ = (last_.T_world_camera.inverse() * f.T_world_camera).log();
      last_interval_ = f.timestamp - last_.timestamp;
    }
    last_reference_ = reference_;
    T_reference_last_ = active().at(reference_.keyframe).T_world_camera.inverse() * f.T_world_camera;
    tracked_.push_back({f.timestamp, last_reference_, T_reference_last_});
    last_ = std::move(f);
  }

  void report(track_result& result, const std::optional<map_keyframe>& made) {
    auto lock = shared_.lock();
    result.state = state_;
    result.map = shared_.atlas.active_id();
    if (made) result.keyframe = shared_.atlas.current(*made).keyframe;
    if (is_tracking()) result.T_world_camera = last_pose();
    const state_event changed{std::exchange(reported_state_, state_), state_, counters_.frames - 1};
    lock.unlock();
    if (changed.from != changed.to && shared_.listening.state_changed) shared_.listening.state_changed(changed);
  }

  [[nodiscard]] orbis::trajectory trajectory_in(map_id map) const {
    orbis::trajectory all;
    for (const tracked_frame& f : tracked_) {
      const map_keyframe k = shared_.atlas.current(f.reference);
      if (k.map == map && shared_.atlas.contains(map))
        all.push_back({f.timestamp, shared_.atlas.at(map).pose_of(k.keyframe) * f.T_reference_camera});
    }
    return all;
  }

  options options_;
  Extractor extract_;
  detail::shared_state<Camera, Places> shared_;
  detail::tracker<Camera, Matchers> track_;
  detail::local_mapper<Camera, Places> mapper_;
  detail::loop_closer<Camera, Places> closer_;

  track_state state_ = track_state::not_started;
  track_state reported_state_ = track_state::not_started;  ///< to the listener
  std::atomic<bool> localization_only_{options_.localization_only};
  bool map_is_frozen_ = false;  ///< `localization_only_` as it was when the frame came
  track_counters counters_;
  std::vector<tracked_frame> tracked_;
  map_keyframe reference_;  ///< that the current frame shares most with
  frame last_;
  map_keyframe last_reference_;
  se3 T_reference_last_;
  std::optional<vec6> velocity_;  ///< of the camera in its own frame, per last interval
  double last_interval_ = 0.0;
  std::optional<double> lost_since_;  ///< time stamp; none: since the next frame

  std::unique_ptr<detail::worker<map_id>> global_worker_;
  std::unique_ptr<detail::worker<map_keyframe>> loop_worker_, map_worker_;
};

template <class Camera>
rgbd_system(Camera, options) -> rgbd_system<Camera>;
template <class Camera>
rgbd_system(Camera) -> rgbd_system<Camera>;
template <class Camera, class Extractor>
rgbd_system(Camera, options, Extractor) -> rgbd_system<Camera, Extractor>;

}  // namespace orbis::slam

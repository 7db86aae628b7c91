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
/// The scheme is that of R. Mur-Artal, J. D. Tardos, "ORB-SLAM2: an open-source SLAM system for monocular, stereo and
/// RGB-D cameras", T-RO 33 (2017): predict the pose by constant motion, search for the landmarks of the local map,
/// refine the pose, make a keyframe where the view has changed, adjust the map around it, and close loops where a place
/// is recognised. That a new map begins after the camera was lost, and that maps are merged, is after R. Elvira, J. D.
/// Tardos, J. M. M. Montiel, "ORBSLAM-Atlas", IROS 2019.
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/slam/atlas.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/system/back_end.hpp>
#include <orbis/slam/detail/system/shared_state.hpp>
#include <orbis/slam/detail/system/stopwatch.hpp>
#include <orbis/slam/detail/tracking/front_end.hpp>
#include <orbis/slam/events.hpp>
#include <orbis/slam/extractor.hpp>
#include <orbis/slam/map_file.hpp>
#include <orbis/slam/matchers.hpp>
#include <orbis/slam/options.hpp>
#include <orbis/slam/place_recognition.hpp>
#include <orbis/slam/sensor.hpp>
#include <orbis/slam/shutter_estimate.hpp>
#include <orbis/slam/track_result.hpp>

namespace orbis::slam {

/// Tracks the frames of one camera and builds a map of landmarks. Images are not kept; a caller who needs those of
/// keyframes keeps them when `track` returns a keyframe.
///
/// Without threads (the default) `track` does everything, and the same frames and options give the same bytes. With
/// threads (`options::threads`) mapping, loop closing and global adjustment go on while frames are tracked. `track` is
/// for one thread; everything else may be called from any thread. An exception on a thread of the system (want of
/// memory, or one of a callback) ends that thread; `track` of a keyframe and `wait` throw it then, and a map may be
/// left half changed: the system is to be destroyed.
///
/// Template parameters: the camera model; the extractor, which determines the type of descriptors; the matchers of
/// tracking; place recognition; the sensor, which determines what a frame measures.
template <camera::camera_model Camera, feature_extractor Extractor = features::orb_extractor,
          tracking_matchers<descriptor_of_t<Extractor>> Matchers = orb_matchers,
          place_recognizer<descriptor_of_t<Extractor>> Places = bag_of_words_places,
          sensor<descriptor_of_t<Extractor>> Sensor = rgbd>
class rgbd_system {
 public:
  using descriptor_type = descriptor_of_t<Extractor>;
  using atlas_type = basic_atlas<descriptor_type>;
  using map_type = basic_map<descriptor_type>;

  /// A system with an extractor made from `settings.features` and default places.
  explicit rgbd_system(Camera camera, const options& settings = {}) requires
      std::constructible_from<Extractor, const features::orb_options&> && std::default_initializable<Places>;
  /// A system with an extractor, and optionally places, of the caller's. `settings.features.levels` and `scale_factor`
  /// must describe the image pyramid of the extractor.
  rgbd_system(Camera camera, const options& settings, Extractor extractor, Places places = Places{});
  rgbd_system(const rgbd_system&) = delete;
  rgbd_system& operator=(const rgbd_system&) = delete;
  /// Waits for the threads to finish their running job; what waits is dropped.
  ~rgbd_system();

  /// Registers callbacks. @pre no frame was tracked yet
  void listen(listeners callbacks);

  /// Tracks the next frame. Frames of another size than the camera's, or without a finite time stamp, count as lost.
  /// @pre time stamps ascend
  track_result track(const camera::rgbd_frame& f) requires
      measures<Sensor, Camera, Extractor, image_view<const rgb8>, camera::depth_view<std::uint16_t>>;
  /// As above; the images are used in place. `timestamp`: seconds; `depth`: metres, registered to the colour image.
  template <camera::depth_source Depth>
  requires measures<Sensor, Camera, Extractor, image_view<const rgb8>, Depth> track_result
  track(double timestamp, image_view<const rgb8> color, const Depth& depth) {
    return track_images(timestamp, color, depth);
  }
  /// As above, for a sensor that takes the two images of a rectified stereo pair. `timestamp`: seconds.
  track_result track(double timestamp, image_view<const rgb8> left, image_view<const rgb8> right) requires
      measures<Sensor, Camera, Extractor, image_view<const rgb8>, image_view<const rgb8>>;
  track_result track(double timestamp, image_view<const std::uint8_t> left,
                     image_view<const std::uint8_t> right) requires
      measures<Sensor, Camera, Extractor, image_view<const std::uint8_t>, image_view<const std::uint8_t>>;

  /// As above, for a sensor that takes one image.
  track_result track(double timestamp,
                     image_view<const rgb8> color) requires measures<Sensor, Camera, Extractor, image_view<const rgb8>>;
  track_result track(double timestamp, image_view<const std::uint8_t> grey) requires
      measures<Sensor, Camera, Extractor, image_view<const std::uint8_t>>;

  /// The state after the last frame.
  [[nodiscard]] track_state state() const;
  /// Whether the map is kept unchanged.
  [[nodiscard]] bool localizes_only() const noexcept { return localization_only_; }
  /// Sets whether the map is kept unchanged, from the next frame on.
  void set_localization_only(bool on) noexcept { localization_only_ = on; }

  /// The features of the last frame and where it hangs in the map; empty if it was not tracked. For the thread that
  /// tracks, and without a lock: asking for it does not wait for the back end. O(features).
  [[nodiscard]] std::optional<tracked_frame> last_frame() const;

  /// Sets `T_world_camera` of the first frame of every map that begins from the next frame on
  /// (`options::initial_pose`). For the thread that tracks: where frames say which way is up, a new map begins upright.
  void set_initial_pose(const se3& T_world_camera) {
    options_.initial_pose = T_world_camera;
    options_.find_initial_pose = nullptr;
  }
  /// As above, asked for only when a map does begin with the frame that is tracked: what it costs is paid once a map
  /// (`options::find_initial_pose`). `find` must not call the system.
  void set_initial_pose(std::function<se3()> find) { options_.find_initial_pose = std::move(find); }

  /// Waits until the threads have nothing to do.
  void wait() const;

  /// Poses of the frames that were tracked in the active map: all, or those that `options::trajectory_frames` leaves.
  /// Frames follow later corrections of their keyframe. O(frames).
  [[nodiscard]] orbis::trajectory trajectory() const;
  /// As above, of another map; empty if there is no such map, or none of its frames is left.
  [[nodiscard]] orbis::trajectory trajectory(map_id map) const;
  /// Time stamp, pose and frame index of each keyframe of the active map.
  [[nodiscard]] std::vector<keyframe_pose> keyframes() const;
  /// As above, unless the poses are those of revision `seen`: then empty. Sets `seen` to the present revision. Cheap
  /// enough to be asked again and again by whoever builds on the keyframes' poses: local adjustment moves keyframes
  /// without an event. O(1) if nothing has changed.
  [[nodiscard]] std::optional<std::vector<keyframe_pose>> keyframes_since(pose_revision& seen) const;
  /// Time stamp and pose of each keyframe of the active map.
  [[nodiscard]] orbis::trajectory keyframe_trajectory() const;
  /// What the frames tell of the shutter; empty without `options::estimates_shutter`. For the thread that tracks.
  [[nodiscard]] std::optional<shutter_estimate> estimated_shutter() const { return front_end_.estimated_shutter(); }
  /// The number of landmarks of the active map.
  [[nodiscard]] std::size_t landmark_count() const;
  [[nodiscard]] track_counters counters() const;
  [[nodiscard]] map_id active_map() const;
  /// The map in which most frames were tracked. O(frames).
  [[nodiscard]] map_id largest_map() const;
  /// Makes a map the active one; the camera is searched for in it. False if there is no such map.
  bool activate(map_id map);

  /// Calls `read(const atlas_type&)` with the lock held: no map changes meanwhile, and tracking waits. `read` must not
  /// call the system.
  template <std::invocable<const atlas_type&> Read>
  decltype(auto) inspect(Read&& read) const {
    const auto lock = shared_.lock();
    return std::forward<Read>(read)(std::as_const(shared_.atlas));
  }
  /// The active map. @pre while it is used, no frame is tracked and the threads have nothing to do (`wait`)
  [[nodiscard]] const map_type& map() const { return shared_.atlas.active(); }
  [[nodiscard]] const Camera& camera() const noexcept { return shared_.rig.camera(); }

  /// Writes the active map to a file. For the descriptors of ORB. Errors: `write_failed`.
  [[nodiscard]] result<void> save_map(const std::filesystem::path& path)
      const requires std::same_as<descriptor_of_t<Extractor>, features::binary_descriptor<256>>;
  /// Reads a map from a file and makes it the active one; the camera is searched for in it. The map so far is kept, and
  /// merged into the loaded one where that is recognised; without keyframes it is removed. For the descriptors of ORB.
  /// Errors: those of `read_map`, `unsupported` for a map of another image pyramid, or one with a scale of its own
  /// where the sensor measures lengths, and the other way round, `no_data` for one without keyframes.
  [[nodiscard]] result<void> load_map(const std::filesystem::path& path) requires
      std::same_as<descriptor_of_t<Extractor>, features::binary_descriptor<256>>;

 private:
  using frame_type = basic_frame<descriptor_type>;

  template <class... Images>
  track_result track_images(double timestamp, const Images&... images);
  /// Whether the images have the size of the camera, and a time.
  template <class... Images>
  [[nodiscard]] bool are_usable(double timestamp, const Images&... images) const {
    return std::isfinite(timestamp) &&
           ((images.width() == camera().width() && images.height() == camera().height()) && ...);
  }
  /// The frame with its features; without any if the images do not fit or it has no time.
  template <class... Images>
  [[nodiscard]] frame_type measure(double timestamp, const Images&... images) const;
  /// Localises a frame and makes a keyframe of it if that is due. `lap`: notes the time of localisation.
  std::optional<map_keyframe> localize(frame_type f,
                                       const std::function<void(frame_type&, const frame_motion&)>& follow_rows,
                                       track_result& result, detail::stopwatch& clock);
  /// Passes a new keyframe to the callbacks and the back end.
  void dispatch_keyframe(map_keyframe k);
  /// Fills in the result of a frame, and reports a change of state.
  void report(track_result& result, const std::optional<map_keyframe>& made);

  options options_;
  Extractor extract_;
  [[no_unique_address]] Sensor sensor_{};
  detail::shared_state<Camera, descriptor_type, Places> shared_;
  detail::front_end<Camera, descriptor_type, Matchers, Sensor> front_end_;
  track_state reported_state_ = track_state::not_started;
  std::atomic<bool> localization_only_;
  detail::back_end<Camera, descriptor_type, Places> back_end_;  ///< last: its threads use the rest
};

template <class Camera>
rgbd_system(Camera, options) -> rgbd_system<Camera>;
template <class Camera>
rgbd_system(Camera) -> rgbd_system<Camera>;
template <class Camera, class Extractor>
rgbd_system(Camera, options, Extractor) -> rgbd_system<Camera, Extractor>;

// The members are defined outside of the class, so that a compiled instantiation of it (`extern template`) covers them.

#define ORBIS_SLAM_SYSTEM_TEMPLATE                                    \
  template <camera::camera_model Camera, feature_extractor Extractor, \
            tracking_matchers<descriptor_of_t<Extractor>> Matchers,   \
            place_recognizer<descriptor_of_t<Extractor>> Places, sensor<descriptor_of_t<Extractor>> Sensor>
#define ORBIS_SLAM_SYSTEM rgbd_system<Camera, Extractor, Matchers, Places, Sensor>

ORBIS_SLAM_SYSTEM_TEMPLATE
ORBIS_SLAM_SYSTEM::rgbd_system(Camera camera, const options& settings) requires
    std::constructible_from<Extractor, const features::orb_options&> && std::default_initializable<Places>
    : rgbd_system(std::move(camera), settings, Extractor(settings.features), Places{}) {}

ORBIS_SLAM_SYSTEM_TEMPLATE
ORBIS_SLAM_SYSTEM::rgbd_system(Camera camera, const options& settings, Extractor extractor, Places places)
    : options_{settings},
      extract_{std::move(extractor)},
      shared_{make_rig(std::move(camera), settings, measures_scale<Sensor>(settings)), options_, std::move(places)},
      front_end_{shared_.rig, options_},
      localization_only_{settings.localization_only},
      back_end_{shared_} {}

ORBIS_SLAM_SYSTEM_TEMPLATE
ORBIS_SLAM_SYSTEM::~rgbd_system() = default;

ORBIS_SLAM_SYSTEM_TEMPLATE
void ORBIS_SLAM_SYSTEM::listen(listeners callbacks) { shared_.callbacks = std::move(callbacks); }

ORBIS_SLAM_SYSTEM_TEMPLATE
track_result ORBIS_SLAM_SYSTEM::track(const camera::rgbd_frame& f) requires
    measures<Sensor, Camera, Extractor, image_view<const rgb8>, camera::depth_view<std::uint16_t>> {
  return track_images(f.timestamp, f.color.view(), f.depth_metres());
}

ORBIS_SLAM_SYSTEM_TEMPLATE
track_result ORBIS_SLAM_SYSTEM::track(double timestamp, image_view<const rgb8> left,
                                      image_view<const rgb8> right) requires
    measures<Sensor, Camera, Extractor, image_view<const rgb8>, image_view<const rgb8>> {
  return track_images(timestamp, left, right);
}

ORBIS_SLAM_SYSTEM_TEMPLATE
track_result ORBIS_SLAM_SYSTEM::track(double timestamp, image_view<const std::uint8_t> left,
                                      image_view<const std::uint8_t> right) requires
    measures<Sensor, Camera, Extractor, image_view<const std::uint8_t>, image_view<const std::uint8_t>> {
  return track_images(timestamp, left, right);
}

ORBIS_SLAM_SYSTEM_TEMPLATE
track_result ORBIS_SLAM_SYSTEM::track(double timestamp, image_view<const rgb8> color) requires
    measures<Sensor, Camera, Extractor, image_view<const rgb8>> {
  return track_images(timestamp, color);
}

ORBIS_SLAM_SYSTEM_TEMPLATE
track_result ORBIS_SLAM_SYSTEM::track(double timestamp, image_view<const std::uint8_t> grey) requires
    measures<Sensor, Camera, Extractor, image_view<const std::uint8_t>> {
  return track_images(timestamp, grey);
}

ORBIS_SLAM_SYSTEM_TEMPLATE
template <class... Images>
track_result ORBIS_SLAM_SYSTEM::track_images(double timestamp, const Images&... images) {
  track_result result;
  detail::stopwatch clock;
  frame_type f = measure(timestamp, images...);
  front_end_.depth().see_nothing();
  if constexpr (has_depth_image<Sensor, Images...>)
    if (are_usable(timestamp, images...)) front_end_.depth().see(Sensor::depth_image(images...));
  clock.lap(result.timings.features_ms);
  if (options_.threads.wait) back_end_.wait_for_room();
  const auto follow_rows = [&](frame_type& seen, const frame_motion& motion) {
    if constexpr (follows_rows<Sensor, descriptor_type, Camera, Images...>)
      Sensor::follow_rows(shared_.rig, motion, seen, images...);
  };
  const std::optional<map_keyframe> made = localize(std::move(f), std::cref(follow_rows), result, clock);
  if (made) {
    if (const auto& first = front_end_.first_keyframe()) dispatch_keyframe(*first);
    dispatch_keyframe(*made);
  }
  report(result, made);
  clock.lap(result.timings.mapping_ms);
  return result;
}

ORBIS_SLAM_SYSTEM_TEMPLATE
template <class... Images>
auto ORBIS_SLAM_SYSTEM::measure(double timestamp, const Images&... images) const -> frame_type {
  frame_type f;
  // Others do not come here; clang before 16 instantiates members of which the constraints do not hold.
  if constexpr (measures<Sensor, Camera, Extractor, Images...>)
    if (are_usable(timestamp, images...)) {
      f = sensor_.measure(shared_.rig, extract_, images...);
      f.scale_is_known = shared_.rig.scale_is_known;
      if (!f.scale_is_known) std::fill(f.depth.begin(), f.depth.end(), 0.0F);  // what a sensor of run time may measure
      if (front_end_.looks_at_rows()) detail::keep_as_read(f);
    }
  f.timestamp = std::isfinite(timestamp) ? timestamp : front_end_.last_timestamp();
  f.index = front_end_.counters().frames;
  return f;
}

ORBIS_SLAM_SYSTEM_TEMPLATE
std::optional<map_keyframe> ORBIS_SLAM_SYSTEM::localize(
    frame_type f, const std::function<void(frame_type&, const frame_motion&)>& follow_rows, track_result& result,
    detail::stopwatch& clock) {
  const auto lock = shared_.lock();
  atlas_type& maps = shared_.atlas;
  const bool is_frozen = localization_only_;
  const auto similar = [this](const auto& features, std::size_t count) {
    return shared_.similar(shared_.places.describe(features), count, [](map_keyframe) { return false; });
  };
  const auto drop = [this](map_id m) {  // unless mapping works on it; then it stays
    if (const auto edit = shared_.try_edit()) shared_.remove_map(m);
  };
  front_end_.sync_with_map(maps);
  result.inliers = front_end_.localize(f, maps, is_frozen, follow_rows, similar, drop);
  clock.lap(result.timings.tracking_ms);
  std::optional<map_keyframe> made;
  if (front_end_.is_tracking()) {
    front_end_.update_reference(f, maps);
    const bool may_grow = front_end_.begins_map() || (!is_frozen && !back_end_.is_full());
    if (may_grow && front_end_.needs_keyframe(f, result.inliers, maps)) made = front_end_.make_keyframe(f, maps);
  }
  front_end_.finish(std::move(f), maps, made);
  return made;
}

ORBIS_SLAM_SYSTEM_TEMPLATE
void ORBIS_SLAM_SYSTEM::dispatch_keyframe(map_keyframe k) {
  if (const auto& callback = shared_.callbacks.keyframe_made)  // its map may have been merged into another one since
    callback(shared_.locked([&] { return shared_.event_of(shared_.atlas.current(k)); }));
  back_end_.process(k);
}

ORBIS_SLAM_SYSTEM_TEMPLATE
void ORBIS_SLAM_SYSTEM::report(track_result& result, const std::optional<map_keyframe>& made) {
  auto lock = shared_.lock();
  result.state = front_end_.state();
  result.map = shared_.atlas.active_id();
  if (made) result.keyframe = shared_.atlas.current(*made).keyframe;
  if (front_end_.is_tracking()) {
    result.T_world_camera = front_end_.last_pose(shared_.atlas);
    result.twist = front_end_.last_twist();
  }
  const state_event changed{std::exchange(reported_state_, result.state), result.state,
                            front_end_.counters().frames - 1};
  lock.unlock();
  if (changed.from != changed.to && shared_.callbacks.state_changed) shared_.callbacks.state_changed(changed);
}

ORBIS_SLAM_SYSTEM_TEMPLATE
track_state ORBIS_SLAM_SYSTEM::state() const {
  return shared_.locked([&] { return front_end_.state(); });
}

ORBIS_SLAM_SYSTEM_TEMPLATE
std::optional<tracked_frame> ORBIS_SLAM_SYSTEM::last_frame() const {
  if (reported_state_ != track_state::tracking && reported_state_ != track_state::relocalized) return std::nullopt;
  return front_end_.last_frame();
}

ORBIS_SLAM_SYSTEM_TEMPLATE
void ORBIS_SLAM_SYSTEM::wait() const { back_end_.wait(); }

ORBIS_SLAM_SYSTEM_TEMPLATE
orbis::trajectory ORBIS_SLAM_SYSTEM::trajectory() const {
  return shared_.locked([&] { return front_end_.log().trajectory(shared_.atlas, shared_.atlas.active_id()); });
}

ORBIS_SLAM_SYSTEM_TEMPLATE
orbis::trajectory ORBIS_SLAM_SYSTEM::trajectory(map_id map) const {
  return shared_.locked([&] { return front_end_.log().trajectory(shared_.atlas, map); });
}

ORBIS_SLAM_SYSTEM_TEMPLATE
std::vector<keyframe_pose> ORBIS_SLAM_SYSTEM::keyframes() const {
  pose_revision never{.map = no_id};
  return *keyframes_since(never);
}

ORBIS_SLAM_SYSTEM_TEMPLATE
std::optional<std::vector<keyframe_pose>> ORBIS_SLAM_SYSTEM::keyframes_since(pose_revision& seen) const {
  return shared_.locked([&]() -> std::optional<std::vector<keyframe_pose>> {
    const map_type& active = shared_.atlas.active();
    const pose_revision now{shared_.atlas.active_id(), active.pose_changes()};
    if (std::exchange(seen, now) == now) return std::nullopt;
    std::vector<keyframe_pose> all;
    for (const auto& k : active.keyframes()) all.push_back({k.timestamp, k.T_world_camera, k.index});
    return all;
  });
}

ORBIS_SLAM_SYSTEM_TEMPLATE
orbis::trajectory ORBIS_SLAM_SYSTEM::keyframe_trajectory() const {
  orbis::trajectory all;
  for (const keyframe_pose& k : keyframes()) all.push_back({k.timestamp, k.T_world_camera});
  return all;
}

ORBIS_SLAM_SYSTEM_TEMPLATE
std::size_t ORBIS_SLAM_SYSTEM::landmark_count() const {
  return shared_.locked([&] { return shared_.atlas.active().landmark_count(); });
}

ORBIS_SLAM_SYSTEM_TEMPLATE
track_counters ORBIS_SLAM_SYSTEM::counters() const {
  return shared_.locked([&] {
    track_counters all = front_end_.counters();
    all.loops_closed = shared_.loops_closed;
    all.maps_merged = shared_.maps_merged;
    all.keyframes_culled = shared_.keyframes_culled;
    return all;
  });
}

ORBIS_SLAM_SYSTEM_TEMPLATE
map_id ORBIS_SLAM_SYSTEM::active_map() const {
  return shared_.locked([&] { return shared_.atlas.active_id(); });
}

ORBIS_SLAM_SYSTEM_TEMPLATE
map_id ORBIS_SLAM_SYSTEM::largest_map() const {
  return shared_.locked([&] { return front_end_.log().largest_map(shared_.atlas); });
}

ORBIS_SLAM_SYSTEM_TEMPLATE
bool ORBIS_SLAM_SYSTEM::activate(map_id map) {
  return shared_.locked([&] {
    if (!shared_.atlas.contains(map)) return false;
    if (map != shared_.atlas.active_id()) {
      shared_.atlas.activate(map);
      front_end_.set_lost();
    }
    return true;
  });
}

ORBIS_SLAM_SYSTEM_TEMPLATE
result<void> ORBIS_SLAM_SYSTEM::save_map(const std::filesystem::path& path)
    const requires std::same_as<descriptor_of_t<Extractor>, features::binary_descriptor<256>> {
  const std::string bytes = inspect([](const atlas_type& all) { return map_bytes(all.active()); });
  return write_map_bytes(path, bytes);
}

ORBIS_SLAM_SYSTEM_TEMPLATE
result<void> ORBIS_SLAM_SYSTEM::load_map(const std::filesystem::path& path) requires
    std::same_as<descriptor_of_t<Extractor>, features::binary_descriptor<256>> {
  auto loaded = read_map(path);
  if (!loaded) return fail(loaded.error());
  const auto& content = loaded->content();
  if (content.levels != shared_.rig.scales.levels() || !(content.scale_factor == shared_.rig.scales.factor()))
    return fail(errc::unsupported, path.string(), "the map was made with another image pyramid");
  if (loaded->scale_is_known() != shared_.rig.scale_is_known)
    return fail(errc::unsupported, path.string(),
                shared_.rig.scale_is_known ? "the map was made without depth, its unit of length is not the metre"
                                           : "the map was made with depth, and this sensor measures none");
  if (loaded->keyframes().empty()) return fail(errc::no_data, path.string(), "the map has no keyframes");
  std::vector<std::pair<keyframe_id, typename Places::signature>> bow_vectors;  // before tracking has to wait
  for (const auto& k : loaded->keyframes()) bow_vectors.emplace_back(k.id, shared_.places.describe(k.features));
  const auto lock = shared_.lock();
  const map_id before = shared_.atlas.active_id();
  const bool drop = shared_.atlas.active().keyframes().empty();
  const map_id id = shared_.atlas.create(*std::move(loaded));
  if (drop) shared_.atlas.remove(before);
  for (const auto& [k, seen] : bow_vectors) shared_.places.add({id, k}, seen);
  front_end_.set_lost();
  return {};
}

#undef ORBIS_SLAM_SYSTEM
#undef ORBIS_SLAM_SYSTEM_TEMPLATE

}  // namespace orbis::slam

#ifdef ORBIS_COMPILED
#include <orbis/slam/detail/compiled/rgbd_system.hpp>
#endif

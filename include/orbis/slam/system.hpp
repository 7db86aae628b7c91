// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Keyframe-based SLAM for an RGB-D camera, a stereo pair or a single camera.
///
/// @code
///   orbis::slam::system slam{camera, orbis::slam::options{}};
///   for (const auto& frame : recording) slam.track(frame);
///   auto trajectory = slam.trajectory();
/// @endcode
///
/// The method follows R. Mur-Artal, J. D. Tardos, "ORB-SLAM2: an open-source SLAM system for monocular, stereo and
/// RGB-D cameras", T-RO 33 (2017): predict the pose with a constant-velocity model, search for the landmarks of the
/// local map, refine the pose, create a keyframe when the view has changed, adjust the map around it, and close loops
/// when a place is recognised. Starting a new map after tracking is lost, and merging maps, follow R. Elvira, J. D.
/// Tardos, J. M. M. Montiel, "ORBSLAM-Atlas", IROS 2019.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/camera/depth.hpp>
#include <orbis/camera/depth_clock.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/slam/atlas.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/depth/depth_copy.hpp>
#include <orbis/slam/detail/system/shared_state.hpp>
#include <orbis/slam/events.hpp>
#include <orbis/slam/extractor.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/matchers.hpp>
#include <orbis/slam/measure.hpp>
#include <orbis/slam/options.hpp>
#include <orbis/slam/place_recognition.hpp>
#include <orbis/slam/shutter_estimate.hpp>
#include <orbis/slam/track_result.hpp>

namespace orbis::slam {
namespace detail {

template <camera::camera_model Camera, feature_descriptor D, tracking_matchers<D> Matchers>
class front_end;
template <camera::camera_model Camera, feature_descriptor D, place_recognizer<D> Places>
class back_end;
class stopwatch;

}  // namespace detail

/// Tracks the frames of one camera and builds a map of landmarks. Images are not kept, except the last two depth images
/// while the shutter is estimated; callers that need keyframe images must store them when `track` returns a keyframe.
///
/// Without threads (the default), `track` does all the work, and the same frames and options give bit-identical
/// results. With threads (`options::threads`) mapping, loop closing and global adjustment run while frames are tracked.
/// Call `track`, `load_map`, `activate` and the functions for the tracking thread from one thread; all others may be
/// called from any thread. An exception on one of the system's threads (`std::bad_alloc`, or one thrown by a callback)
/// ends that thread; `wait`, and `track` when it creates a keyframe, then rethrow it. Then destroy the system.
///
/// Template parameters: the camera model; the extractor, which determines the descriptor type; the matchers for
/// tracking; place recognition. orbis::compiled contains the system for `camera::any_camera` and the default
/// components. A program that links it and replaces a component includes `<orbis/slam/system-inl.hpp>`; for a camera
/// other than `any_camera` and `pinhole`, also `pose_refinement-inl.hpp`, `pnp-inl.hpp` and
/// `bundle_adjustment-inl.hpp` of `optimize`.
template <camera::camera_model Camera, feature_extractor Extractor = features::orb_extractor,
          tracking_matchers<descriptor_of_t<Extractor>> Matchers = orb_matchers,
          place_recognizer<descriptor_of_t<Extractor>> Places = bag_of_words_places>
class system {
 public:
  using descriptor_type = descriptor_of_t<Extractor>;
  using atlas_type = basic_atlas<descriptor_type>;
  using map_type = basic_map<descriptor_type>;
  using revision_type = pose_revision;
  /// A function that creates a frame, as those of `measure.hpp` do, with the depth of each feature, or 0.
  using measure_function =
      std::function<basic_frame<descriptor_type>(const camera_rig<Camera>& rig, const Extractor& extract)>;

  /// Creates a system with an extractor built from `settings.features` and default place recognition.
  explicit system(Camera camera, const options& settings = {}) requires
      std::constructible_from<Extractor, const features::orb_options&> && std::default_initializable<Places>;
  /// Creates a system with a custom extractor and, optionally, custom place recognition. `settings.features.levels` and
  /// `scale_factor` must describe the image pyramid of the extractor.
  system(Camera camera, const options& settings, Extractor extractor, Places places = Places{});
  system(const system&) = delete;
  system& operator=(const system&) = delete;
  /// Waits for the threads to finish their current jobs; discards waiting jobs.
  ~system();

  /// Registers callbacks. @pre no frame has been tracked yet
  void listen(listeners callbacks);

  /// Tracks the next frame. Frames whose size differs from the camera's or whose timestamp is not finite count as lost.
  /// @pre timestamps increase
  track_result track(const camera::rgbd_frame& f) {
    return track(f.timestamp, f.color.view(), f.depth_metres(), f.depth_timestamp);
  }
  /// As above; the images are not copied. `timestamp`: time of the colour image, seconds; `depth`: metres, registered
  /// to the colour image; `depth_timestamp`: time of the depth image on the same clock, if different. Depth is
  /// corrected for the difference, which is smoothed over about a second; differences of more than 0.1 s are ignored.
  /// orbis::compiled contains this function for `camera::depth_view` of 16-bit integers and of float; for others
  /// include system-inl.hpp.
  template <camera::depth_source Depth>
  track_result track(double timestamp, image_view<const rgb8> color, const Depth& depth,
                     std::optional<double> depth_timestamp = {});
  /// As above, for a rectified stereo pair (`stereo_options`). `timestamp`: seconds.
  track_result track(double timestamp, image_view<const rgb8> left, image_view<const rgb8> right);
  track_result track(double timestamp, image_view<const std::uint8_t> left,
                     image_view<const std::uint8_t> right) requires grey_extractor<Extractor>;
  /// As above, for one image without depth, for a system with `monocular_options`.
  track_result track(double timestamp, image_view<const rgb8> color);
  track_result track(double timestamp, image_view<const std::uint8_t> grey) requires grey_extractor<Extractor>;
  /// As above, for another kind of sensor. There is no depth image for `options::depth_term`, and depth is assumed to
  /// be measured at the frame's time. @pre `measure` is not empty
  track_result track_measured(double timestamp, const measure_function& measure);

  /// The state after the last frame.
  [[nodiscard]] track_state state() const;
  /// Enables or disables localisation-only mode, starting with the next frame; if `on`, the map is kept unchanged.
  void set_localization_only(bool on) noexcept { localization_only_ = on; }

  /// Returns the features of the last frame and its pose relative to a keyframe; empty if it was not tracked. For the
  /// tracking thread only; takes no lock, so it does not wait for the back end. O(features).
  [[nodiscard]] std::optional<tracked_frame> last_frame() const;

  /// Sets `T_world_camera` of the first frame of every map started by the next or a later frame
  /// (`options::initial_pose`). For the tracking thread only. Example: if the gravity direction is known for each
  /// frame, new maps can start upright.
  void set_initial_pose(const se3& T_world_camera) {
    options_.initial_pose = T_world_camera;
    options_.find_initial_pose = nullptr;
  }
  /// As above, but `find` is called only when the tracked frame starts a map, so its cost is incurred once per map
  /// (`options::find_initial_pose`). `find` must not call the system.
  void set_initial_pose(std::function<se3()> find) { options_.find_initial_pose = std::move(find); }

  /// Waits until the threads are idle.
  void wait() const;
  /// Requests that mapping end soon so that a program can exit: running adjustments end early, and neither waiting nor
  /// later keyframes are mapped or checked for loops, nor are frames localised again. `wait` then returns soon, and all
  /// results so far can be read. May be called from any thread. Cannot be undone.
  void stop() noexcept;

  /// Returns the poses of the frames that were tracked in the active map: all, or those within
  /// `options::trajectory_frames`. The poses follow later corrections of the keyframes. Unless fewer than 100 frames
  /// are kept, the first 100 frames of a map are localised again after five more keyframes; with threads, call `wait`
  /// first. O(frames).
  [[nodiscard]] orbis::trajectory trajectory() const;
  /// As above, for another map; empty if that map does not exist or none of its frames is left.
  [[nodiscard]] orbis::trajectory trajectory(map_id map) const;
  /// Returns the timestamp, pose and frame index of each keyframe of the active map.
  [[nodiscard]] std::vector<keyframe_pose> keyframes() const;
  /// As above, but empty if `seen` is the current revision. Sets `seen` to the current revision. Suitable for polling
  /// by code that builds on the keyframes' poses: local adjustment moves keyframes without an event. O(1) if nothing
  /// has changed.
  [[nodiscard]] std::optional<std::vector<keyframe_pose>> keyframes_since(pose_revision& seen) const;
  /// Returns the timestamp and pose of each keyframe of the active map.
  [[nodiscard]] orbis::trajectory keyframe_trajectory() const;
  /// Returns the estimated shutter; empty without `options::estimates_shutter`. For the tracking thread only.
  [[nodiscard]] std::optional<shutter_estimate> estimated_shutter() const;
  /// The exposure time of the images, seconds: `patch_options::exposure`, or the estimate from their motion blur, which
  /// is 0 unless blur is visible. For the tracking thread only.
  [[nodiscard]] double exposure() const;
  /// The number of landmarks of the active map.
  [[nodiscard]] std::size_t landmark_count() const;
  [[nodiscard]] track_counters counters() const;
  [[nodiscard]] map_id active_map() const;
  /// Returns the map in which the most frames were tracked. O(frames).
  [[nodiscard]] map_id largest_map() const;
  /// Activates a map; the camera is relocalised in it. Returns false if there is no such map.
  bool activate(map_id map);

  /// Calls `read(const atlas_type&)` with the lock held: no map changes during the call, and tracking has to wait.
  /// `read` must not call the system.
  template <std::invocable<const atlas_type&> Read>
  decltype(auto) inspect(Read&& read) const {
    const auto lock = shared_.lock();
    return std::forward<Read>(read)(std::as_const(shared_.atlas));
  }
  /// Returns the active map. @pre while the map is in use, no frame is tracked and the threads are idle (`wait`)
  [[nodiscard]] const map_type& map() const { return shared_.atlas.active(); }
  [[nodiscard]] const Camera& camera() const noexcept { return shared_.rig.camera(); }

  /// Writes the active map to a file. For ORB descriptors only. Errors: `write_failed`.
  [[nodiscard]] result<void> save_map(const std::filesystem::path& path)
      const requires std::same_as<descriptor_of_t<Extractor>, features::binary_descriptor<256>>;
  /// Reads a map from a file and activates it; the camera is relocalised in it. The previous map is kept, and merged
  /// with the loaded one when a common place is recognised; if the previous map has no keyframes, it is removed. For
  /// ORB descriptors only. Errors: those of `read_map`; `unsupported` for a map with another image pyramid, or if
  /// only one of the map and the sensor has metric scale; `no_data` for a map without keyframes.
  [[nodiscard]] result<void> load_map(const std::filesystem::path& path) requires
      std::same_as<descriptor_of_t<Extractor>, features::binary_descriptor<256>>;

 private:
  using frame_type = basic_frame<descriptor_type>;
  using front_end = detail::front_end<Camera, descriptor_type, Matchers>;
  using back_end = detail::back_end<Camera, descriptor_type, Places>;
  /// Returns true if the images have the size of the camera and the timestamp is finite.
  template <class... Images>
  [[nodiscard]] bool are_usable(double timestamp, const Images&... images) const {
    return std::isfinite(timestamp) &&
           ((images.width() == camera().width() && images.height() == camera().height()) && ...);
  }
  /// Tracks a measured frame; the frame has no features if its images could not be used.
  track_result track_frame(double timestamp, frame_type f, const row_reader& follow, detail::stopwatch& clock);
  /// Passes a new keyframe to the callbacks and to the back end.
  void dispatch_keyframe(map_keyframe k);
  /// Fills in the result of a frame, and reports a change of state.
  void report(track_result& result, const std::optional<map_keyframe>& made);

  options options_;
  Extractor extract_;
  stereo_memory stereo_;
  image_memory image_;
  camera::depth_clock depth_clock_;
  std::array<detail::depth_copy, 2>
      read_later_;  ///< the depth images of the last two frames, while the shutter is estimated
  detail::shared_state<Camera, descriptor_type, Places> shared_;
  std::unique_ptr<front_end> front_end_;
  track_state reported_state_ = track_state::not_started;
  std::atomic<bool> localization_only_;
  std::unique_ptr<back_end> back_end_;  ///< declared last: its threads use the other members
};

template <class Camera>
system(Camera, options) -> system<typename camera::checked_camera<Camera>::type>;
template <class Camera>
system(Camera) -> system<typename camera::checked_camera<Camera>::type>;
template <class Camera, class Extractor>
system(Camera, options, Extractor) -> system<typename camera::checked_camera<Camera>::type, Extractor>;

/// A system for colour images with registered depth. The first frame with enough depth starts a map.
template <camera::camera_model Camera, feature_extractor Extractor = features::orb_extractor,
          tracking_matchers<descriptor_of_t<Extractor>> Matchers = orb_matchers,
          place_recognizer<descriptor_of_t<Extractor>> Places = bag_of_words_places>
class rgbd_system : public system<Camera, Extractor, Matchers, Places> {
 public:
  using system<Camera, Extractor, Matchers, Places>::system;
};
template <class Camera>
rgbd_system(Camera, options) -> rgbd_system<typename camera::checked_camera<Camera>::type>;
template <class Camera>
rgbd_system(Camera) -> rgbd_system<typename camera::checked_camera<Camera>::type>;
template <class Camera, class Extractor>
rgbd_system(Camera, options, Extractor) -> rgbd_system<typename camera::checked_camera<Camera>::type, Extractor>;

/// A system for rectified stereo pairs, with `stereo_options`.
using stereo_system = system<camera::any_camera>;
/// A system for one camera without depth: lengths are in an arbitrary unit per map, regardless of the options.
template <camera::camera_model Camera>
class monocular_system : public system<Camera> {
 public:
  explicit monocular_system(Camera camera, options settings = monocular_options())
      : system<Camera>(std::move(camera), without_scale(std::move(settings))) {}

 private:
  [[nodiscard]] static options without_scale(options settings) {
    settings.scale_is_measured = false;
    return settings;
  }
};

}  // namespace orbis::slam

#ifndef ORBIS_COMPILED
#include <orbis/slam/system-inl.hpp>
#endif

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Events and callbacks of a live map with its own thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>
#include <orbis/mapping/live_map.hpp>
#include <orbis/octree/change_log.hpp>

namespace orbis::mapping {

/// An immutable snapshot of the map.
template <class Octree>
struct live_map_snapshot {
  Octree map;
  std::uint64_t revision = 0;  ///< revision of the change log
  std::size_t keyframes = 0;   ///< number of keyframes added and not removed
  std::size_t frames = 0;      ///< number of other frames in the map
  std::size_t pending = 0;     ///< keyframes and bricks waiting for a correction; 0: the map is up to date
};

/// The function to which a depth image was passed.
enum class depth_use : std::uint8_t {
  keyframe,  ///< add_keyframe
  frame      ///< add_frame: a frame between keyframes
};

/// A keyframe or frame was inserted into the map, and is visible to readers.
struct insertion_event {
  std::uint64_t frame = 0;
  bool is_keyframe = false;
  double milliseconds = 0.0;        ///< wall time of `prepare`, moved-object removal, marking and storing the image
  double delay_milliseconds = 0.0;  ///< time from the call that added the image until readers can see it
  std::size_t waiting = 0;          ///< number of keyframes and frames still waiting
};
/// A depth image was dropped because too many were waiting.
struct overflow_event {
  std::uint64_t frame = 0;
  depth_use use = depth_use::keyframe;
};
/// The map rejected a frame between keyframes: see live_map::add_frame.
struct refusal_event {
  std::uint64_t frame = 0;
  std::uint64_t keyframe = 0;
};
/// All corrections of keyframes and bricks are complete.
struct live_correction_event {
  std::size_t keyframes = 0;  ///< number of moved keyframes
  std::size_t bricks = 0;     ///< number of updated bricks
  double milliseconds = 0.0;  ///< wall time of the correction, excluding insertions between its parts
};

/// Poses of the keyframes from the SLAM system.
struct keyframe_poses {
  std::vector<keyframe_position> poses{};  ///< current poses; keyframes that are not listed are hidden
  std::vector<std::uint64_t> removed{};    ///< frame indices of keyframes that will never get a pose again
};

/// Callbacks; any of them may be empty. All except `overflowed` are called on the map's thread; the constructor calls
/// `published` for the first, empty map. They must not wait for the map, or destroy it. An exception on the map's
/// thread ends that thread, see live_map_thread::failure.
template <class Octree>
struct live_map_listeners {
  std::function<void()> started{};  ///< called first on the map's thread, to name the thread or lower its priority
  /// Fills in the current poses and returns true, or returns false if the poses have not changed since the last call;
  /// with `always`, always fills them in. Hidden keyframes may return with their map of the atlas, so their depth
  /// images are kept in memory. List culled keyframes in `removed` to remove them from the map.
  std::function<bool(keyframe_poses& now, bool always)> poll_poses{};
  /// May change a depth image before it is inserted: a filter sets the pixels that it removes to 0. Called on the map's
  /// thread, so that no other thread waits for it.
  std::function<void(std::uint64_t frame, depth_use use, image_view<std::uint16_t> pixels)> prepare{};
  std::function<void(const insertion_event&)> inserted{};
  std::function<void(const overflow_event&)> overflowed{};  ///< called on the thread that adds the image
  std::function<void(const refusal_event&)> refused{};
  std::function<void(const live_correction_event&)> corrected{};
  /// Called with each new snapshot and the log of changes up to it; the log may be read during the call.
  std::function<void(const live_map_snapshot<Octree>&, const octree::change_log&)> published{};
  /// Called if a depth image could not be stored or read (see live_map), or if an error ended the thread (see
  /// live_map_thread::failure).
  std::function<void(const error&)> failed{};
};

/// Returns a callback for `live_map_listeners::poll_poses` that reads the keyframe poses of a SLAM system. The system
/// must outlive the map's thread. Culled keyframes stay hidden in the map; `live_map_thread::remove` frees their
/// memory.
template <class Slam>
[[nodiscard]] auto follow_keyframes(const Slam& slam) {
  return [&slam, seen = typename Slam::revision_type{}](keyframe_poses& now, bool always) mutable {
    if (always) seen = {};
    const auto poses = slam.keyframes_since(seen);
    if (poses)
      for (const auto& k : *poses) now.poses.push_back({k.frame, k.T_world_camera});
    return poses.has_value();
  };
}
template <class Slam>
void follow_keyframes(const Slam&&) = delete;

struct live_map_counters {
  std::size_t keyframes = 0;          ///< number of inserted keyframes
  std::size_t frames = 0;             ///< number of inserted frames between keyframes
  std::size_t dropped_keyframes = 0;  ///< keyframes dropped because too many were waiting
  std::size_t dropped_frames = 0;     ///< frames dropped because too many images were waiting
  std::size_t refused_frames = 0;     ///< frames rejected by the map
  std::size_t corrections = 0;        ///< number of finished corrections
  std::size_t most_waiting = 0;       ///< largest number of depth images that waited at the same time
};

}  // namespace orbis::mapping

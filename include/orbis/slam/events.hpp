// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Events of the SLAM system and their callbacks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string_view>

#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/track_result.hpp>

namespace orbis::slam {

/// A keyframe was created or culled. With `options::trajectory_frames`, maps eventually forget the poses of culled
/// keyframes (`basic_map::remembers`).
struct keyframe_event {
  map_keyframe id;
  double timestamp = 0.0;  ///< seconds
  std::size_t frame = 0;   ///< index of the frame, from 0
  se3 T_world_camera;      ///< in the world frame of its map
};

enum class correction_kind : std::uint8_t {
  loop,               ///< a loop was closed
  global_adjustment,  ///< all keyframes and landmarks of a map were adjusted
  merge               ///< a map was merged into another one
};

[[nodiscard]] constexpr std::string_view to_string(correction_kind kind) noexcept {
  switch (kind) {
    case correction_kind::loop: return "loop";
    case correction_kind::global_adjustment: return "global adjustment";
    case correction_kind::merge: return "merge";
  }
  return "unknown";
}

/// A correction that changed the poses of a map by more than local adjustment does. Data derived from the poses must be
/// updated.
struct correction_event {
  correction_kind kind{};
  map_id map = 0;  ///< the corrected map
  /// For a loop or a merge: the two keyframes at the same place (`from` with its new id). With threads, either may have
  /// been erased since then (`basic_atlas::current` returns its replacement).
  map_keyframe from{}, to{};
  map_id merged = 0;          ///< for a merge: the map that was merged into `map`
  id_offsets offsets{};       ///< for a merge: the offsets added to the ids of `merged`
  sim3 T_corrected_before{};  ///< the correction at keyframe `from`, in the map's world frame; scale 1 with depth
  /// For a merge: the transform from the previous world frame of `map` to its new one if `merged` is the older map,
  /// whose world frame is kept; otherwise the identity.
  sim3 T_map_before{};
  double milliseconds = 0.0;         ///< wall time
  double locked_milliseconds = 0.0;  ///< the longest time for which tracking and queries had to wait
};

/// The state of tracking changed.
struct state_event {
  track_state from{};  ///< the state before the change
  track_state to{};
  std::size_t frame = 0;  ///< index of the frame, from 0
};

/// Callbacks; any of them may be empty. They are called without a lock held, so they may query the system. With
/// threads, the callbacks for culled keyframes and corrections are called on the system's threads. They must not wait
/// for the system; an exception thrown on a thread of the system ends that thread (see `system`).
struct listeners {
  std::function<void(const keyframe_event&)> keyframe_made{};
  std::function<void(const keyframe_event&)> keyframe_culled{};
  std::function<void(const correction_event&)> map_corrected{};
  std::function<void(const state_event&)> state_changed{};
};

}  // namespace orbis::slam

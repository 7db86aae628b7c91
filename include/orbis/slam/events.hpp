// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the SLAM system tells those who listen.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string_view>

#include <orbis/core/se3.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/track_result.hpp>

namespace orbis::slam {

/// A keyframe that was made or culled.
struct keyframe_event {
  map_keyframe id;
  double timestamp = 0.0;
  std::size_t frame = 0;  ///< index of the frame it was, from 0
  se3 T_world_camera;     ///< in the world of its map
};

enum class correction_kind : std::uint8_t {
  loop,               ///< the keyframes were brought in line with a loop that was closed
  global_adjustment,  ///< keyframes and landmarks were adjusted all at once
  merge               ///< a map has become a part of another
};

[[nodiscard]] constexpr std::string_view to_string(correction_kind kind) noexcept {
  switch (kind) {
    case correction_kind::loop: return "loop";
    case correction_kind::global_adjustment: return "global adjustment";
    case correction_kind::merge: return "merge";
  }
  return "unknown";
}

/// Poses of a map have changed by more than local adjustment does: what was built on them is to be moved.
struct correction_event {
  correction_kind kind{};
  map_id map = 0;             ///< that was corrected
  map_keyframe from{}, to{};  ///< the keyframes that show the same place, of a loop or merge (`from` by its new name)
  map_id merged = 0;          ///< the map that is no more, of a merge
  id_offsets offsets{};       ///< what its numbers have grown by
  se3 T_corrected_before{};   ///< what the correction was at keyframe `from`
  double milliseconds = 0.0;  ///< it took
};

struct state_event {
  track_state from{};  ///< what was told last
  track_state to{};
  std::size_t frame = 0;
};

/// Called without any lock held, so that they may ask the system for what they want; those of mapping and corrections
/// from the system's own threads, if it has any: they must not wait for the system, nor throw. May be left empty.
struct listeners {
  std::function<void(const keyframe_event&)> keyframe_made{};
  std::function<void(const keyframe_event&)> keyframe_culled{};
  std::function<void(const correction_event&)> map_corrected{};
  std::function<void(const state_event&)> state_changed{};
};

}  // namespace orbis::slam

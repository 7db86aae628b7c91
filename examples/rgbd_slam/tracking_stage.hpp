// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Frames in, trajectory and keyframes out.
#pragma once

#include <optional>

#include "console.hpp"
#include "posed_frames.hpp"
#include "results.hpp"
#include "settings.hpp"
#include "source.hpp"

namespace app {

struct tracked_frames {
  slam_results slam;
  posed_frames keyframes;               ///< with their images, for the map
  std::optional<orbis::error> stopped;  ///< why not all frames were read
};

/// Tracks the source's frames, up to the first that cannot be read, or to Ctrl-C.
[[nodiscard]] tracked_frames track(const frame_source& source, const settings& s, console& say);

/// The error that stopped the tracking, with what was reached. @pre tracked.stopped
[[nodiscard]] orbis::error explain_stop(const tracked_frames& tracked, const frame_source& source);

}  // namespace app

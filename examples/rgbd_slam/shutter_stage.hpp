// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The camera's shutter: given, or estimated from the recording.
#pragma once

#include <string>

#include "console.hpp"
#include "results.hpp"
#include "settings.hpp"
#include "source.hpp"

namespace app {

/// Takes the shutter from `--read-out-ms`, or else from the camera's settings, or else the typical shutter of the
/// camera if it is known and depth images have separate time stamps, or else estimates it: tracks the first `seconds`
/// of the recording, up to the first unreadable frame. Live frames cannot be tracked twice; for them, a global shutter
/// is assumed at first.
[[nodiscard]] shutter_results find_shutter(const frame_source& source, const settings& s, double seconds,
                                           console& console);

/// The camera with the given shutter, for a camera file. An estimate of zero is omitted: it may only mean that this
/// recording is inconclusive. The typical shutter is omitted if the camera is enough to find it again.
[[nodiscard]] orbis::camera::camera_settings with_shutter(orbis::camera::camera_settings camera,
                                                          const shutter_results& shutter);

/// A description of the shutter, with the standard deviation of an estimate.
[[nodiscard]] std::string describe(const shutter_results& shutter);

}  // namespace app

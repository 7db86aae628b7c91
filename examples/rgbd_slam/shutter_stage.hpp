// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The camera's shutter: given, or estimated from the first seconds of the recording.
#pragma once

#include <optional>
#include <string>

#include "camera_check.hpp"
#include "console.hpp"
#include "results.hpp"
#include "settings.hpp"
#include "source.hpp"

namespace app {

struct camera_inspection {
  shutter_results shutter;
  std::optional<focal_doubt>
      doubt;  ///< doubt about the focal length, if a check was requested and the first seconds were tracked
};

/// Takes the shutter from `--read-out-ms`, or else from the camera's settings, or else estimates it: tracks the first
/// ten seconds, up to the first unreadable frame. If `checks_camera` is true, also checks the focal length.
[[nodiscard]] camera_inspection find_shutter(const frame_source& source, const settings& s, bool checks_camera,
                                             console& console);

/// The camera with the given shutter, for a camera file. An estimate of zero is omitted: it may only mean that this
/// recording is inconclusive.
[[nodiscard]] orbis::camera::camera_settings with_shutter(orbis::camera::camera_settings camera,
                                                          const shutter_results& shutter);

/// A description of the shutter, with the standard deviation of an estimate.
[[nodiscard]] std::string describe(const shutter_results& shutter);

}  // namespace app

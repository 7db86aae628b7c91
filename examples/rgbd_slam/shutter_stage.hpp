// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// When the rows of the camera's images are taken: as it is said, or as the first seconds of the recording tell.
#pragma once

#include <optional>
#include <string>

#include "camera_check.hpp"
#include "console.hpp"
#include "results.hpp"
#include "settings.hpp"
#include "source.hpp"

namespace app {

struct first_look {
  shutter_results shutter;
  std::optional<focal_doubt> doubt;  ///< of those seconds' map, where they were looked at and it was asked for
};

/// As `--read-out-ms` says, otherwise as the camera's settings do, otherwise estimated from the first ten seconds,
/// which are tracked for this alone. Frames that cannot be read end that.
[[nodiscard]] first_look find_shutter(const frame_source& source, const settings& s, bool checks_camera,
                                      console& console);

/// The camera with that shutter, for a camera file. An estimate of zero is left out: another recording may tell more.
[[nodiscard]] orbis::camera::camera_settings with_shutter(orbis::camera::camera_settings camera,
                                                          const shutter_results& shutter);

/// In words, with its deviation where it was estimated.
[[nodiscard]] std::string in_words(const shutter_results& shutter);

}  // namespace app

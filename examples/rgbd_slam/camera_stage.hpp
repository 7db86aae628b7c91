// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Replacement of a camera that a recording contradicts.
#pragma once

#include <optional>
#include <string>

#include <orbis/camera/any.hpp>
#include <orbis/camera/shutter.hpp>

#include "camera_check.hpp"
#include "console.hpp"
#include "settings.hpp"
#include "source.hpp"

namespace app {

/// Returns true if a run may replace the camera of a recording with depth by a calibrated one. False if it has already
/// been replaced, with `--intrinsics given`, with `--camera`, and if a landmark map is loaded or saved, because runs
/// that share a map need the same camera.
[[nodiscard]] bool may_refine(const frame_source& source, const settings& s);

/// Calibrates the camera with at most the first minute of the recording. Returns the calibrated camera if it confirms
/// the focal length in `doubt` to within 2 %; otherwise, or if the user interrupts the calibration, empty.
[[nodiscard]] std::optional<orbis::camera::any_camera> refine_camera(const frame_source& source,
                                                                     const orbis::camera::shutter& shutter,
                                                                     const focal_doubt& doubt, const settings& s,
                                                                     console& console);

/// Replaces the camera of the source. Returns the warning for the user.
[[nodiscard]] std::string replace_camera(frame_source& source, const orbis::camera::any_camera& refined);

}  // namespace app

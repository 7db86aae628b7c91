// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What is to be known of the camera before its frames are tracked for good.
#pragma once

#include "console.hpp"
#include "results.hpp"
#include "settings.hpp"
#include "source.hpp"

namespace app {

/// Finds the shutter (`find_shutter`). Where that looked at the first seconds, and they clearly do not fit the camera's
/// focal length (`focal_doubt::is_sure`), the camera is calibrated by the recording, at most by its first minute, and
/// replaced if that finds the same focal length, within two percent; unless `--intrinsics given` or `--camera` say
/// which camera it is, or a map of landmarks is loaded or saved: runs that share one need the same camera.
[[nodiscard]] shutter_results get_to_know_camera(frame_source& source, const settings& s, console& console);

}  // namespace app

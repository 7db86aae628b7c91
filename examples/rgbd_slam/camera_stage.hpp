// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Estimation of shutter and camera before tracking.
#pragma once

#include "console.hpp"
#include "results.hpp"
#include "settings.hpp"
#include "source.hpp"

namespace app {

/// Determines the shutter (`find_shutter`). If this step tracks the first seconds of the recording, and these clearly
/// contradict the camera's focal length (`focal_doubt::is_sure`), calibrates the camera with at most the first minute
/// of the recording. The result replaces the camera if it confirms the focal length estimated from the first seconds to
/// within 2 %. The camera remains unchanged with `--intrinsics given`, with `--camera`, and if a landmark map is loaded
/// or saved, because runs that share a map need the same camera.
[[nodiscard]] shutter_results prepare_camera(frame_source& source, const settings& s, console& console);

}  // namespace app

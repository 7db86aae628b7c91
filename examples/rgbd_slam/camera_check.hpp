// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Whether the camera's focal length fits what was recorded with it.
#pragma once

#include <optional>
#include <string>

#include <orbis/slam/any_system.hpp>

namespace app {

/// What the user should know where the images of the active map fit another focal length clearly better than the
/// camera's; empty where they do not, or do not tell. Poses of a wrong camera are some percent too near to each other
/// or too far apart. A small self-calibration: some tenths of a second.
[[nodiscard]] std::optional<std::string> doubt_focal_length(const orbis::slam::any_system& slam,
                                                            const orbis::camera::any_camera& camera,
                                                            const orbis::slam::options& options);

}  // namespace app

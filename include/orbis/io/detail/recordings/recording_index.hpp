// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the readers of recording formats hand to `recording`: a list of frames, not yet read.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/settings.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/trajectory.hpp>

namespace orbis::io::detail {

/// A colour camera, and where the depth camera is in its frame.
struct color_camera {
  camera::pinhole model;
  se3 T_color_depth;
};

/// One frame: its files and what is known about their moment.
struct recording_entry {
  double timestamp = 0.0;  ///< of the colour image, seconds
  std::filesystem::path color;
  std::filesystem::path depth;        ///< empty where there is one camera only
  std::optional<se3> T_world_camera;  ///< ground truth, where there is one
};

/// A recording without its pixels.
struct recording_index {
  std::vector<recording_entry> frames;  ///< in the order of time, never empty when handed out
  trajectory ground_truth;
  std::optional<camera::camera_settings> camera;  ///< where the format's own files tell
  std::optional<color_camera> color;              ///< where colour is to be resampled to the camera of depth
  std::vector<std::string> notes;                 ///< what a user should be warned about
  std::vector<std::filesystem::path> files;       ///< that were read for this; images are not among them
};

}  // namespace orbis::io::detail

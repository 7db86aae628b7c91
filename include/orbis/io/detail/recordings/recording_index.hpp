// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Index that the readers of recording formats pass to `recording`: a list of frames, not yet read.
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

/// A colour camera, and the pose of the depth camera in its frame.
struct color_camera {
  camera::pinhole model;
  se3 T_color_depth;
};

/// One frame: its files, time and pose.
struct recording_entry {
  double timestamp = 0.0;  ///< time of the colour image, seconds
  std::filesystem::path color;
  std::filesystem::path depth;              ///< empty in a recording of one camera
  std::optional<se3> T_world_camera;        ///< ground truth, if there is one
  std::optional<double> depth_timestamp{};  ///< time of the depth image, seconds, if it differs from `timestamp`
};

/// A recording without its image data.
struct recording_index {
  std::vector<recording_entry> frames;  ///< in chronological order, never empty when returned
  trajectory ground_truth;
  std::optional<camera::camera_settings> camera;  ///< set if found in the format's own files, or guessed
  std::string camera_guess;                       ///< name and origin of a guessed camera, else empty
  std::optional<color_camera> color;              ///< set if colour has to be resampled to the depth camera
  std::vector<std::string> notes;                 ///< warnings for the user
  std::vector<std::filesystem::path> files;       ///< files that were read for the index, excluding images
};

}  // namespace orbis::io::detail

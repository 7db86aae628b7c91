// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Reading of camera files: camera.toml, and the files of other programs.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <orbis/camera/settings.hpp>
#include <orbis/core/result.hpp>

namespace app {

/// A camera read from another program's file. A width of 0 means that the file does not specify the image size, so that
/// images of any size are accepted.
struct camera_file {
  orbis::camera::camera_settings camera;
  std::filesystem::path path;
  bool has_depth_scale = false;  ///< the file specifies `depth_scale`, which is otherwise assumed
  /// Describes the camera for a note.
  [[nodiscard]] std::string describe() const;
};

/// Reads a JSON or YAML file: Open3D (`intrinsic_matrix`), librealsense (`fx`, `ppx`, `coeffs`),
/// `sensor_msgs/CameraInfo` as text, ROS calibrations (`camera_matrix`), ORB-SLAM settings (`Camera.fx`,
/// `DepthMapFactor`); or a text file with a 3x3 matrix or `fx fy cx cy`. A depth scale below 1 is the depth unit in
/// metres. Errors: not_found, unreadable, malformed, unsupported (a distortion model).
[[nodiscard]] orbis::result<camera_file> read_camera_file(const std::filesystem::path& path);

/// The camera given by the option --camera: `camera.toml`, a file that `read_camera_file` reads, or a preset. Errors:
/// those of `read_camera_file`.
[[nodiscard]] orbis::result<orbis::camera::camera_settings> named_camera(const std::string& name);

/// The path of another program's camera file for the recording in `folder`. The file must have one of the usual names;
/// the path is empty if there is no such file.
[[nodiscard]] std::filesystem::path find_camera_file(const std::filesystem::path& folder);

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Cameras that give frames as they take them.
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <orbis/camera/settings.hpp>
#include <orbis/core/result.hpp>

#include "source.hpp"

namespace app {

class camera_device {
 public:
  virtual ~camera_device() = default;
  /// The next frame, once there is one; nothing if none came within `patience`. Errors: no_data (the device is a
  /// recording, and at its end), others (it is gone). Called on one thread.
  [[nodiscard]] virtual orbis::result<std::optional<source_frame>> next(std::chrono::milliseconds patience) = 0;

  std::string name;
  orbis::slam::sensor_kind sensor = orbis::slam::sensor_kind::rgbd;
  orbis::camera::camera_settings camera;
  std::vector<std::string> notes;            ///< worth a warning
  std::vector<std::filesystem::path> files;  ///< that it is read from, if it is a recording
};

/// Which camera, and how.
struct device_options {
  std::string name;                                        ///< of the device; empty: the first one
  std::optional<orbis::slam::sensor_kind> sensor{};        ///< empty: as the device suggests
  std::optional<orbis::camera::camera_settings> camera{};  ///< instead of what the device says
};

/// Whether this build knows depth cameras (OpenNI2), video cameras (V4L2 through OpenCV).
[[nodiscard]] bool has_openni();
[[nodiscard]] bool has_video_cameras();

/// A depth camera: Astra, Xtion, PrimeSense; or an .oni file, which plays as if it were one. Depth is registered to
/// colour by the device. `name`: its URI, or the file. Errors: unsupported (this build knows none), not_found.
[[nodiscard]] orbis::result<std::unique_ptr<camera_device>> open_openni(const device_options& options);
/// A video camera: one, or, with `sensor` stereo, two whose rectified images stand side by side. `name`: its file
/// (/dev/video0) or its number. Errors: as above, and those of `check_camera`.
[[nodiscard]] orbis::result<std::unique_ptr<camera_device>> open_video_camera(const device_options& options);
/// The recording in a folder (`name`), whose frames come at the pace of their time stamps: a camera for tests, and to
/// try out whether a computer keeps up. Errors: those of `open_recording`.
[[nodiscard]] orbis::result<std::unique_ptr<camera_device>> open_playback(const device_options& options);

}  // namespace app

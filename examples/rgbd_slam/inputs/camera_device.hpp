// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Live cameras.
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
  /// Waits for the next frame; empty if none arrives within `patience`. Errors: no_data (end of a played recording),
  /// others (the device is disconnected). Called on one thread only.
  [[nodiscard]] virtual orbis::result<std::optional<source_frame>> next(std::chrono::milliseconds patience) = 0;

  std::string name;
  orbis::slam::sensor_kind sensor = orbis::slam::sensor_kind::rgbd;
  orbis::camera::camera_settings camera;
  std::vector<std::string> notes;            ///< warnings
  std::vector<std::filesystem::path> files;  ///< input files of a played recording
};

/// Options that select and configure a camera.
struct device_options {
  std::string name;                                        ///< name of the device; empty: the first one
  std::optional<orbis::slam::sensor_kind> sensor{};        ///< empty: determined by the device
  std::optional<orbis::camera::camera_settings> camera{};  ///< replaces the device's calibration
};

/// Returns true if this build supports depth cameras (OpenNI2) or video cameras (V4L2 through OpenCV).
[[nodiscard]] bool has_openni();
[[nodiscard]] bool has_video_cameras();

/// Opens a depth camera (Astra, Xtion, PrimeSense), or plays an .oni file. The device registers depth to colour.
/// `name`: the URI of the device, or the path of the .oni file. Errors: unsupported (not in this build), not_found.
[[nodiscard]] orbis::result<std::unique_ptr<camera_device>> open_openni(const device_options& options);
/// Opens a video camera; if `sensor` is stereo, a camera that delivers two rectified images side by side. `name`: the
/// device file (/dev/video0) or number. Errors: those of `open_openni` and `check_camera`.
[[nodiscard]] orbis::result<std::unique_ptr<camera_device>> open_video_camera(const device_options& options);
/// Plays the recording in a folder (`name`) at the rate of its timestamps, for tests without a camera. Errors: those of
/// `open_recording`.
[[nodiscard]] orbis::result<std::unique_ptr<camera_device>> open_playback(const device_options& options);

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Videos and video cameras are read by a separate module, `rgbd_slam_video.so` next to the program. It is loaded when
/// the first of them is opened, because OpenCV's videoio depends on about two hundred libraries, which would cost every
/// run half a second and 60 MB.
#pragma once

#include <filesystem>
#include <memory>

#include <orbis/core/result.hpp>

#include "inputs/camera_device.hpp"
#include "inputs/file_recording.hpp"

extern "C" {
/// Implements `app::open_video`.
void rgbd_slam_open_video(const std::filesystem::path& path, const app::file_recording_options& options,
                          orbis::result<std::unique_ptr<app::file_recording>>& opened);
/// Implements `app::open_video_camera`.
void rgbd_slam_open_video_camera(const app::device_options& options,
                                 orbis::result<std::unique_ptr<app::camera_device>>& opened);
}

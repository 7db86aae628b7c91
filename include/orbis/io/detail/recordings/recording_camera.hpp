// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The camera of a recording: given by the user, stored in the folder, or known from the format.
#pragma once

#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <orbis/camera/settings.hpp>
#include <orbis/core/result.hpp>
#include <orbis/io/camera_file.hpp>
#include <orbis/io/detail/recordings/recording_folder.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>
#include <orbis/io/detail/time_stamp.hpp>

namespace orbis::io::detail {

/// The camera `given` by the user, or else the camera in `camera.toml` in `folder`, which is added to `files`; empty if
/// neither exists. Errors: those of `read_camera`.
template <class = void>
[[nodiscard]] result<std::optional<camera::camera_settings>> given_camera(
    const std::filesystem::path& folder, const std::optional<camera::camera_settings>& given,
    std::vector<std::filesystem::path>& files) {
  const auto file = folder / "camera.toml";
  if (given || !present(file)) return given;
  auto read = read_camera(file);
  if (!read) return fail(read.error());
  files.push_back(file);
  return std::optional{*std::move(read)};
}

/// Error for a recording whose camera is neither given nor known.
template <class = void>
[[nodiscard]] error unknown_camera(const std::filesystem::path& folder) {
  return {errc::invalid_argument, folder.string(),
          "the camera is not known: put a camera.toml into the folder, or specify a camera"};
}

/// Adds a note if the time between frames does not match a camera with `fps` frames per second.
template <class = void>
void note_interval(recording_index& index, double fps) {
  if (std::string warning = describe_interval(timestamps(index.frames), fps); !warning.empty())
    index.notes.push_back(std::move(warning));
}

/// If `camera` is empty, sets it to the camera of the index, with a note if that camera is guessed. Adds a note if the
/// time between frames does not match the frame rate of the camera. Errors: invalid_argument (no camera is known).
template <class = void>
[[nodiscard]] result<void> complete_camera(const std::filesystem::path& folder,
                                           std::optional<camera::camera_settings>& camera, recording_index& index) {
  if (!camera && index.camera && !index.camera_guess.empty()) {
    const camera::intrinsics& k = index.camera->model.k();
    char text[200];
    std::snprintf(text, sizeof text, "%d x %d, fx %.6g, fy %.6g, cx %.6g, cy %.6g, depth_scale %.6g", k.width, k.height,
                  k.fx, k.fy, k.cx, k.cy, index.camera->depth_scale);
    index.notes.push_back("the camera is " + index.camera_guess + ": " + text);
  }
  if (!camera) camera = index.camera;
  if (!camera) return fail(unknown_camera(folder));
  note_interval(index, camera->fps);
  return {};
}

}  // namespace orbis::io::detail

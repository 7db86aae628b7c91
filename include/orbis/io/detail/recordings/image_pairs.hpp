// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A plain folder of stereo images: `left.txt` (or `rgb.txt`) and `right.txt`, lists as TUM has them, or numbered
/// images in `left` (or `rgb`) and `right`; `camera.toml`, and possibly `groundtruth.txt`.
///
/// Rectified images have one camera, with its `baseline`. Others have a second one in `camera_right.toml`, and its
/// place in `T_left_right.txt`: a 4x4 matrix from the right camera's frame to the left one's, metres.
#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <orbis/camera/settings.hpp>
#include <orbis/camera/stereo.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/result.hpp>
#include <orbis/io/camera_file.hpp>
#include <orbis/io/detail/recordings/paired_images.hpp>
#include <orbis/io/detail/recordings/recording_folder.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>
#include <orbis/io/detail/recordings/seven_scenes.hpp>
#include <orbis/io/detail/recordings/stereo_index.hpp>
#include <orbis/io/detail/recordings/tum.hpp>
#include <orbis/io/detail/text.hpp>

namespace orbis::io::detail {

/// Whether `folder` looks like one of stereo images.
[[nodiscard]] inline bool is_image_pairs(const std::filesystem::path& folder) {
  const bool lists = present(folder / "right.txt") && !first_present(folder, {"left.txt", "rgb.txt"}).empty();
  return lists || (present(folder / "right") && !first_present(folder, {"left", "rgb"}).empty());
}

/// The numbered images in `folder`, at `fps` images a second. Errors: no_data.
[[nodiscard]] inline result<std::vector<stamped_file>> numbered_images(const std::filesystem::path& folder, double fps,
                                                                       std::vector<std::string>& notes) {
  std::vector<stamped_file> files;
  for (const auto& path : list_folder(folder)) {
    unsigned number = 0;
    if (parse_number(path.stem().string(), number) && is_image_name(path)) files.push_back({number / fps, path});
  }
  if (files.empty()) return fail(errc::no_data, folder.string(), "there are no numbered images (000000.png) in it");
  return in_order_of_time(folder, std::move(files), notes);
}

/// The index of such a folder. `camera`: instead of `camera.toml`. Errors: not_found (a file), unreadable, no_data,
/// malformed (with file and line), invalid_argument (no camera, or no baseline).
[[nodiscard]] inline result<stereo_index> index_image_pairs(const std::filesystem::path& folder,
                                                            double max_time_difference,
                                                            std::optional<camera::camera_settings> camera) {
  stereo_index index;
  recording_index& images = index.images;
  const auto camera_file = folder / "camera.toml", right_file = folder / "camera_right.toml",
             place_file = folder / "T_left_right.txt";
  if (!camera && present(camera_file)) {
    auto read = read_camera(camera_file);
    if (!read) return fail(read.error());
    camera = *std::move(read);
    images.files.push_back(camera_file);
  }
  if (!camera)
    return fail(errc::invalid_argument, folder.string(),
                "the camera is not known: put a camera.toml into the folder, or name a camera");
  index.fps = camera->fps;
  index.shutter = camera->shutter;
  if (present(right_file)) {
    const auto right = read_camera(right_file);
    if (!right) return fail(right.error());
    const auto text = read_file(place_file);
    if (!text) return fail(text.error());
    const auto T_left_right = parse_pose_matrix(*text, place_file);
    if (!T_left_right) return fail(T_left_right.error());
    index.cameras = {camera->model, right->model, *T_left_right};
    images.files.insert(images.files.end(), {right_file, place_file});
  } else {
    if (!camera->baseline)
      return fail(
          errc::invalid_argument, folder.string(),
          "the distance of the two cameras is not known: camera.toml needs a baseline, or camera_right.toml and "
          "T_left_right.txt have to be there");
    index.cameras = {camera->model, camera->model, se3{so3{}, vec3{*camera->baseline, 0.0, 0.0}}};
  }

  std::vector<stamped_file> lists[2];
  for (const int i : {0, 1}) {
    const auto list = i == 0 ? first_present(folder, {"left.txt", "rgb.txt"}) : first_present(folder, {"right.txt"});
    const auto numbered = i == 0 ? first_present(folder, {"left", "rgb"}) : folder / "right";
    auto files =
        list.empty() ? numbered_images(numbered, camera->fps, images.notes) : read_image_list(list, images.notes);
    if (!files) return fail(files.error());
    lists[i] = *std::move(files);
    if (!list.empty()) images.files.push_back(list);
  }
  if (auto paired = pair_images(lists[0], lists[1], folder, max_time_difference, images); !paired)
    return fail(paired.error());
  if (const auto truth = read_ground_truth(folder, max_time_difference, images); !truth) return fail(truth.error());
  return index;
}

}  // namespace orbis::io::detail

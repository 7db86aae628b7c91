// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Recordings in the layout of the 7-Scenes data set: `frame-XXXXXX.color.png` (or `.jpg`), `frame-XXXXXX.depth.png`,
/// `frame-XXXXXX.pose.txt`, optionally `camera-intrinsics.txt`.
///
/// Source: J. Shotton et al., "Scene coordinate regression forests for camera relocalization in RGB-D
/// images", CVPR 2013. Depth is in millimetres; 0 and 65535 are invalid. Colour and depth come from two cameras and are
/// not registered to each other.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <orbis/camera/plausible.hpp>
#include <orbis/camera/settings.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/io/detail/files/pose_matrix.hpp>
#include <orbis/io/detail/recordings/recording_folder.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>
#include <orbis/io/detail/text.hpp>
#include <orbis/io/image.hpp>

namespace orbis::io::detail {

/// Parses a 3x3 camera matrix, or the upper left 3x3 block of a 4x4 matrix. Errors: malformed.
template <class = void>
[[nodiscard]] result<mat3> parse_camera_matrix(std::string_view text, const std::filesystem::path& path) {
  double values[16];
  int count = 0;
  bool ok = true;
  for_each_line(text, [&](std::string_view line, std::size_t) {
    for (std::string_view field = next_field(line); ok && !field.empty(); field = next_field(line)) {
      ok = count < 16 && parse_number(field, values[count]) && std::isfinite(values[count]);
      ++count;
    }
    return ok;
  });
  if (!ok || (count != 9 && count != 16))
    return fail(errc::malformed, path.string(), "a camera matrix must have 9 or 16 finite numbers");
  mat3 k;
  for (int row = 0; row != 3; ++row)
    for (int column = 0; column != 3; ++column) k(row, column) = values[row * (count == 9 ? 3 : 4) + column];
  if (!(k(0, 0) > 0.0) || !(k(1, 1) > 0.0) || k(0, 1) != 0.0)
    return fail(errc::malformed, path.string(), "focal lengths must be above zero, and the skew must be zero");
  return k;
}

/// Reads a camera matrix. Errors: not_found, unreadable, malformed.
template <class = void>
[[nodiscard]] result<mat3> read_camera_matrix(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return fail(text.error());
  return parse_camera_matrix(*text, path);
}

inline constexpr std::string_view seven_scenes_color[] = {".color.png", ".color.jpg"};

/// Returns true if `name` is the name of a colour image; if so, sets its stem and number.
template <class = void>
bool seven_scenes_frame(const std::string& name, std::string& stem, unsigned& number) {
  if (!name.starts_with("frame-")) return false;
  for (const std::string_view ending : seven_scenes_color) {
    if (!name.ends_with(ending)) continue;
    stem = name.substr(0, name.size() - ending.size());
    return parse_number(std::string_view{stem}.substr(6), number);
  }
  return false;
}

template <class = void>
bool has_seven_scenes_frames(const std::filesystem::path& folder) {
  for (const auto& path : list_folder(folder)) {
    std::string stem;
    unsigned number = 0;
    if (seven_scenes_frame(path.filename().string(), stem, number)) return true;
  }
  return false;
}

/// The subfolders seq-XX that contain frames.
template <class = void>
std::vector<std::filesystem::path> seven_scenes_sequences(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> found;
  for (const auto& path : list_folder(folder))
    if (path.filename().string().starts_with("seq-") && has_seven_scenes_frames(path)) found.push_back(path);
  return found;
}

/// Returns true if `folder` looks like a 7-Scenes recording (or a scene with recordings in folders seq-XX).
template <class = void>
[[nodiscard]] bool is_seven_scenes(const std::filesystem::path& folder) {
  return has_seven_scenes_frames(folder) || !seven_scenes_sequences(folder).empty();
}

/// Sets the pose of a frame from its pose file, if it exists, and adds it to the ground truth; counts a lost pose in
/// `lost`. Errors: unreadable, malformed.
template <class = void>
[[nodiscard]] result<void> read_frame_pose(const std::filesystem::path& file, recording_entry& frame,
                                           recording_index& index, std::size_t& lost) {
  if (!present(file)) return {};
  const auto text = read_file(file);
  if (!text) return fail(text.error());
  index.files.push_back(file);
  if (is_lost_pose(*text)) {
    ++lost;
    return {};
  }
  const auto pose = parse_pose_matrix(*text, file);
  if (!pose) return fail(pose.error());
  frame.T_world_camera = *pose;
  index.ground_truth.push_back({frame.timestamp, *pose});
  return {};
}

/// The index of a 7-Scenes recording, with times computed from the frame numbers at 30 frames per second. If `folder`
/// is a scene with a single folder seq-XX, that folder is indexed. `camera-intrinsics.txt` is assumed to describe the
/// depth camera, whose image size is that of the first depth image. Errors: no_data, not_found, unreadable, malformed
/// (a pose, with its file), invalid_argument (a scene with several sequences).
template <class = void>
[[nodiscard]] result<recording_index> index_seven_scenes(std::filesystem::path folder) {
  if (!has_seven_scenes_frames(folder)) {
    const auto sequences = seven_scenes_sequences(folder);
    if (sequences.size() > 1)
      return fail(errc::invalid_argument, folder.string(),
                  "holds " + std::to_string(sequences.size()) + " sequences: specify one of them, for example " +
                      sequences.front().filename().string());
    if (!sequences.empty()) folder = sequences.front();
  }

  recording_index index;
  std::size_t without_depth = 0, lost = 0;
  for (const auto& color : list_folder(folder)) {
    std::string stem;
    unsigned number = 0;
    if (!seven_scenes_frame(color.filename().string(), stem, number)) continue;
    recording_entry frame{number / 30.0, color, folder / (stem + ".depth.png"), {}};
    if (!present(frame.depth)) {
      ++without_depth;
      continue;
    }
    if (const auto read = read_frame_pose(folder / (stem + ".pose.txt"), frame, index, lost); !read)
      return fail(read.error());
    index.frames.push_back(std::move(frame));
  }
  std::stable_sort(index.frames.begin(), index.frames.end(),
                   [](const recording_entry& a, const recording_entry& b) { return a.timestamp < b.timestamp; });
  std::stable_sort(index.ground_truth.begin(), index.ground_truth.end(),
                   [](const stamped_pose& a, const stamped_pose& b) { return a.timestamp < b.timestamp; });
  if (index.frames.empty() && without_depth != 0)
    return fail(errc::no_data, folder.string(),
                std::to_string(without_depth) + " colour images have no frame-*.depth.png; the folder " +
                    describe_content(folder));
  if (const auto ok = check_first_frame(index, folder); !ok) return fail(ok.error());
  if (without_depth != 0)
    index.notes.push_back(std::to_string(without_depth) + " colour images have no depth image and are skipped");
  if (lost != 0) index.notes.push_back(lost_frames_note(lost, index.frames.size()));
  index.notes.push_back("colour and depth are not registered in this format: colours are slightly misaligned");

  std::filesystem::path intrinsics = folder / "camera-intrinsics.txt";
  if (!present(intrinsics)) intrinsics = folder.parent_path() / "camera-intrinsics.txt";
  if (present(intrinsics)) {
    const auto k = read_camera_matrix(intrinsics);
    if (!k) return fail(k.error());
    index.files.push_back(intrinsics);
    const auto first = read_depth(index.frames.front().depth);
    if (!first) return fail(first.error());
    const auto checked = camera::plausible(
        {first->width(), first->height(), (*k)(0, 0), (*k)(1, 1), (*k)(0, 2), (*k)(1, 2)}, intrinsics.string());
    if (!checked) return fail(checked.error());
    index.camera = camera::camera_settings{.model = camera::pinhole{*checked}, .depth_scale = 1000.0, .fps = 30.0};
  }
  return index;
}

}  // namespace orbis::io::detail

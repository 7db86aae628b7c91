// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// ScanNet scenes as its tools export them: `color/N.jpg`, `depth/N.png`, `pose/N.txt`, and in `intrinsic` (or next to
/// the folders) `intrinsic_color.txt`, `intrinsic_depth.txt`, `extrinsic_color.txt`, `extrinsic_depth.txt`.
///
/// Source: A. Dai et al., "ScanNet: richly-annotated 3D reconstructions of indoor scenes", CVPR 2017, and the data
/// set's website. Depth is in millimetres and has fewer pixels than colour; poses are from camera to world, with
/// infinite elements where the camera was lost. The extrinsics transform from a camera to a common frame, and are
/// usually the identity.
#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string>
#include <utility>

#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/plausible.hpp>
#include <orbis/camera/settings.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/io/detail/files/pose_matrix.hpp>
#include <orbis/io/detail/recordings/color_registration.hpp>
#include <orbis/io/detail/recordings/recording_folder.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>
#include <orbis/io/detail/recordings/seven_scenes.hpp>
#include <orbis/io/detail/text.hpp>
#include <orbis/io/image.hpp>

namespace orbis::io::detail {

/// The path of the calibration file `what` (such as "intrinsic_depth") of a ScanNet scene; empty if there is none.
template <class = void>
[[nodiscard]] std::filesystem::path scannet_file(const std::filesystem::path& folder, const std::string& what) {
  std::string plural = what;  // spelling in the smaller edition of the data set
  plural.insert(plural.find('_'), "s");
  for (const auto& path :
       {folder / "intrinsic" / (what + ".txt"), folder / (what + ".txt"), folder / (plural + ".txt")})
    if (present(path)) return path;
  return {};
}

/// Returns true if `folder` looks like an exported ScanNet scene.
template <class = void>
[[nodiscard]] bool is_scannet(const std::filesystem::path& folder) {
  return present(folder / "color") && present(folder / "depth") && !scannet_file(folder, "intrinsic_depth").empty();
}

/// The index of an exported scene, with times computed from the frame numbers at 30 frames per second. Its camera is
/// the depth camera; see `color_registration`. Errors: not_found, unreadable, no_data, malformed (with the file).
template <class = void>
[[nodiscard]] result<recording_index> index_scannet(const std::filesystem::path& folder) {
  constexpr double frames_per_second = 30.0;
  recording_index index;
  std::size_t without_depth = 0, without_pose = 0;
  for (const auto& color : list_folder(folder / "color")) {
    unsigned number = 0;
    const std::string stem = color.stem().string(), ending = color.extension().string();
    if (!parse_number(stem, number) || (ending != ".jpg" && ending != ".png")) continue;
    recording_entry frame{number / frames_per_second, color, folder / "depth" / (stem + ".png"), {}};
    if (!present(frame.depth)) {
      ++without_depth;
      continue;
    }
    if (const auto read = read_frame_pose(folder / "pose" / (stem + ".txt"), frame, index, without_pose); !read)
      return fail(read.error());
    index.frames.push_back(std::move(frame));
  }
  const auto earlier = [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; };
  std::stable_sort(index.frames.begin(), index.frames.end(), earlier);
  std::stable_sort(index.ground_truth.begin(), index.ground_truth.end(), earlier);
  if (index.frames.empty())
    return fail(errc::no_data, folder.string(),
                "no image color/N.jpg with a depth image depth/N.png: color " + describe_content(folder / "color") +
                    ", depth " + describe_content(folder / "depth"));
  if (const auto ok = check_first_frame(index, folder); !ok) return fail(ok.error());
  if (without_depth != 0)
    index.notes.push_back(std::to_string(without_depth) + " colour images have no depth image and are skipped");
  if (without_pose != 0) index.notes.push_back(lost_frames_note(without_pose, index.frames.size()));

  const auto first_color = read_color(index.frames.front().color);
  if (!first_color) return fail(first_color.error());
  const auto first_depth = read_depth(index.frames.front().depth);
  if (!first_depth) return fail(first_depth.error());
  const auto read_camera = [&](const char* what, int width, int height) -> result<camera::pinhole> {
    auto file = scannet_file(folder, what);
    if (file.empty()) file = folder / "intrinsic" / (std::string{what} + ".txt");  // to name it in the error
    const auto k = read_camera_matrix(file);
    if (!k) return fail(k.error());
    index.files.push_back(file);
    const auto checked =
        camera::plausible({width, height, (*k)(0, 0), (*k)(1, 1), (*k)(0, 2), (*k)(1, 2)}, file.string());
    if (!checked) return fail(checked.error());
    return camera::pinhole{*checked};
  };
  const auto read_pose = [&](const char* what) -> result<se3> {
    const auto file = scannet_file(folder, what);
    if (file.empty()) return se3{};
    index.files.push_back(file);
    return read_pose_matrix(file);
  };
  const auto color = read_camera("intrinsic_color", first_color->width(), first_color->height());
  if (!color) return fail(color.error());
  const auto depth = read_camera("intrinsic_depth", first_depth->width(), first_depth->height());
  if (!depth) return fail(depth.error());
  const auto T_rig_color = read_pose("extrinsic_color"), T_rig_depth = read_pose("extrinsic_depth");
  if (!T_rig_color) return fail(T_rig_color.error());
  if (!T_rig_depth) return fail(T_rig_depth.error());
  index.camera = camera::camera_settings{.model = *depth, .depth_scale = 1000.0, .fps = frames_per_second};
  const color_camera beside{*color, T_rig_color->inverse() * *T_rig_depth};
  if (!(color->k() == depth->k()) || norm(beside.T_color_depth.log()) > 1e-6) index.color = beside;
  return index;
}

}  // namespace orbis::io::detail

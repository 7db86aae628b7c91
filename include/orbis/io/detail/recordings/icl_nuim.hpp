// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// ICL-NUIM recordings in their TUM-compatible layout: `rgb/N.png`, `depth/N.png`, optionally `associations.txt` and
/// `*.gt.freiburg`.
///
/// Source: A. Handa et al., "A benchmark for RGB-D visual odometry, 3D reconstruction and SLAM", ICRA 2014. The time
/// stamps are frame numbers of a camera at 30 Hz. The poses are those of a left-handed camera with y up, while the
/// images are stored top down; this reader mirrors the poses, so that they match the images (y down).
#pragma once

#include <filesystem>
#include <utility>

#include <orbis/camera/presets.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/io/detail/recordings/image_folders.hpp>
#include <orbis/io/detail/recordings/recording_folder.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>
#include <orbis/io/detail/recordings/tum.hpp>
#include <orbis/io/trajectory_file.hpp>

namespace orbis::io::detail {

/// The file `*.gt.freiburg` in `folder`, or an empty path.
template <class = void>
std::filesystem::path icl_ground_truth(const std::filesystem::path& folder) {
  for (const auto& path : list_folder(folder))
    if (path.filename().string().ends_with(".gt.freiburg")) return path;
  return {};
}

/// Converts a pose from left-handed frames (y up) to frames with y down by mirroring it in the x-z plane.
template <class = void>
se3 mirrored_y(const se3& pose) {
  const auto& q = pose.rotation().unit_quaternion();
  const vec3& t = pose.translation();
  return se3(so3(so3::quaternion(q.w(), -q.x(), q.y(), -q.z())), vec3(t.x(), -t.y(), t.z()));
}

/// Returns true if `folder` is an ICL-NUIM recording. It must contain the data set's trajectory file, because other
/// recordings with numbered images come from other cameras.
template <class = void>
[[nodiscard]] bool is_icl_nuim(const std::filesystem::path& folder) {
  return !present(folder / "rgb.txt") && present(folder / "rgb") && present(folder / "depth") &&
         !icl_ground_truth(folder).empty();
}

/// The index of an ICL-NUIM recording, with the data set's camera. Integer time stamps are converted to seconds at 30
/// frames per second. Errors: those of `index_tum` and `index_image_folders`.
template <class = void>
[[nodiscard]] result<recording_index> index_icl_nuim(const std::filesystem::path& folder) {
  constexpr double frames_per_second = 30.0, max_time_difference = 0.5 / frames_per_second;
  auto read = find_association_list(folder).empty()
                  ? index_image_folders(folder, max_time_difference, frames_per_second)
                  : index_tum(folder, max_time_difference, frames_per_second);
  if (!read) return read;
  recording_index index = *std::move(read);
  if (const auto file = icl_ground_truth(folder); !file.empty()) {
    if (auto taken = take_ground_truth(read_trajectory_file(file), index); !taken) return fail(taken.error());
    index.files.push_back(file);
    for (stamped_pose& pose : index.ground_truth)
      pose = {pose.timestamp / frames_per_second, mirrored_y(pose.T_world_camera)};
    index.notes.push_back(file.string() + ": left-handed poses with y up, mirrored to right-handed ones with y down");
  }
  attach_ground_truth(index, max_time_difference);
  if (auto camera = camera::preset("icl")) index.camera = *std::move(camera);
  index.camera_guess = "icl, the camera of the ICL-NUIM data set";
  return index;
}

}  // namespace orbis::io::detail

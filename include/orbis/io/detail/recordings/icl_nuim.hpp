// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// ICL-NUIM recordings in their TUM-compatible layout: `rgb/N.png`, `depth/N.png`, optionally `associations.txt` and
/// `*.gt.freiburg`.
///
/// Source: A. Handa et al., "A benchmark for RGB-D visual odometry, 3D reconstruction and SLAM", ICRA 2014. The time
/// stamps are frame numbers of a camera at 30 Hz. The poses are those of a left-handed camera with y up, while the
/// images are stored top down; they are mirrored here, so that poses and images agree in the frames of orbis (y down).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <orbis/camera/presets.hpp>
#include <orbis/core/result.hpp>
#include <orbis/io/detail/recordings/recording_folder.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>
#include <orbis/io/detail/recordings/tum.hpp>
#include <orbis/io/detail/text.hpp>
#include <orbis/io/trajectory_file.hpp>

namespace orbis::io::detail {

/// The file `*.gt.freiburg` in `folder`, or an empty path.
inline std::filesystem::path icl_ground_truth(const std::filesystem::path& folder) {
  for (const auto& path : list_folder(folder))
    if (path.filename().string().ends_with(".gt.freiburg")) return path;
  return {};
}

/// The frames `rgb/N.png` that have a `depth/N.png`, with N as time stamp.
inline std::vector<recording_entry> icl_numbered_frames(const std::filesystem::path& folder,
                                                        std::vector<std::string>& notes) {
  std::vector<recording_entry> frames;
  std::size_t without_depth = 0;
  for (const auto& color : list_folder(folder / "rgb")) {
    unsigned number = 0;
    const std::string extension = color.extension().string();
    if (!parse_number(color.stem().string(), number) || (extension != ".png" && extension != ".jpg")) continue;
    const auto depth = folder / "depth" / color.filename().replace_extension(".png");
    if (present(depth))
      frames.push_back({static_cast<double>(number), color, depth, {}});
    else
      ++without_depth;
  }
  if (without_depth != 0)
    notes.push_back(std::to_string(without_depth) + " colour images have no depth image and are skipped");
  std::stable_sort(frames.begin(), frames.end(),
                   [](const recording_entry& a, const recording_entry& b) { return a.timestamp < b.timestamp; });
  return frames;
}

/// Converts a pose of the left-handed frames (y up) to one with y down: mirrors it at the x-z plane.
inline se3 mirrored_y(const se3& pose) {
  const auto& q = pose.rotation().unit_quaternion();
  const vec3& t = pose.translation();
  return se3(so3(so3::quaternion(q.w(), -q.x(), q.y(), -q.z())), vec3(t.x(), -t.y(), t.z()));
}

/// Returns true if `folder` looks like an ICL-NUIM recording: numbered images without a list of their times. A folder
/// with `associations.txt` and `groundtruth.txt`, which that data set does not have, is a TUM recording: neither its
/// camera nor a mirrored world may be assumed.
[[nodiscard]] inline bool is_icl_nuim(const std::filesystem::path& folder) {
  if (present(folder / "rgb.txt") || !present(folder / "rgb") || !present(folder / "depth")) return false;
  if (!icl_ground_truth(folder).empty()) return true;
  if (present(folder / "associations.txt") && present(folder / "groundtruth.txt")) return false;
  return present(folder / "rgb" / "0.png") || present(folder / "rgb" / "1.png");
}

/// The index of an ICL-NUIM recording, with the data set's camera. Whole-numbered time stamps are converted to seconds
/// at 30 frames per second. Errors: as `index_tum`.
[[nodiscard]] inline result<recording_index> index_icl_nuim(const std::filesystem::path& folder) {
  constexpr double frames_per_second = 30.0;
  recording_index index;
  if (const auto list = folder / "associations.txt"; present(list)) {
    auto frames = read_associations(list, index.notes);
    if (!frames) return fail(frames.error());
    index.frames = *std::move(frames);
    index.files = {list};
  } else {
    if (!present(folder / "rgb")) return fail(errc::not_found, (folder / "rgb").string(), "no such folder");
    index.frames = icl_numbered_frames(folder, index.notes);
  }
  if (const auto ok = check_first_frame(index, folder); !ok) return fail(ok.error());

  if (const auto file = icl_ground_truth(folder); !file.empty()) {
    auto truth = read_trajectory(file);
    if (!truth) return fail(truth.error());
    index.ground_truth = *std::move(truth);
    index.files.push_back(file);
    for (stamped_pose& pose : index.ground_truth) pose.T_world_camera = mirrored_y(pose.T_world_camera);
    index.notes.push_back(file.string() + ": left-handed poses with y up, mirrored to right-handed ones with y down");
  }
  const bool numbered = std::all_of(index.frames.begin(), index.frames.end(), [](const recording_entry& frame) {
    return frame.timestamp == std::floor(frame.timestamp);
  });
  if (numbered) {
    for (recording_entry& frame : index.frames) frame.timestamp /= frames_per_second;
    for (stamped_pose& pose : index.ground_truth) pose.timestamp /= frames_per_second;
  }
  attach_ground_truth(index, 0.5 / frames_per_second);
  if (auto camera = camera::preset("icl")) index.camera = *std::move(camera);
  return index;
}

}  // namespace orbis::io::detail

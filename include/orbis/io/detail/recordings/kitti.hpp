// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// KITTI odometry sequences: `image_0` and `image_1` (or `image_2` and `image_3`), `calib.txt`,
/// `times.txt`, and poses in `poses.txt` or in `../../poses/<sequence>.txt`.
///
/// Source: A. Geiger, P. Lenz, R. Urtasun, "Are we ready for autonomous driving? The KITTI vision benchmark suite",
/// CVPR 2012, and the benchmark's development kit. The images are rectified.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/plausible.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/io/detail/files/pose_matrix.hpp>
#include <orbis/io/detail/files/time_list.hpp>
#include <orbis/io/detail/recordings/recording_folder.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>
#include <orbis/io/detail/recordings/stereo_index.hpp>
#include <orbis/io/detail/text.hpp>
#include <orbis/io/image.hpp>

namespace orbis::io::detail {

/// Parses the numbers in a line. Empty unless the line consists of exactly `N` finite numbers.
template <std::size_t N>
[[nodiscard]] std::optional<std::array<double, N>> parse_numbers(std::string_view line) {
  std::array<double, N> all{};
  for (double& value : all)
    if (!parse_number(next_field(line), value) || !std::isfinite(value)) return std::nullopt;
  return trimmed(line).empty() ? std::optional{all} : std::nullopt;
}

/// The pose in the frame of camera 0, in metres, of a camera with the projection matrix K [I t].
template <class = void>
[[nodiscard]] se3 kitti_place(const std::array<double, 12>& p) {
  return se3{so3{}, -vec3{(p[3] - p[2] * p[11]) / p[0], (p[7] - p[6] * p[11]) / p[5], p[11]}};
}

/// The camera of a rectified pair: focal lengths, principal point, and baseline in metres.
struct kitti_calibration {
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0, baseline = 0.0;
  se3 T_first_left;  ///< pose of the left camera in the frame of camera 0
};

/// Parses the projection matrix `P<camera>:` in `calib.txt`, stored row by row. Errors: malformed (missing, not a
/// matrix, not a camera's matrix).
template <class = void>
[[nodiscard]] result<std::array<double, 12>> parse_kitti_projection(std::string_view text, int camera,
                                                                    const std::filesystem::path& where) {
  const std::string wanted = "P" + std::to_string(camera);
  std::optional<std::array<double, 12>> found;
  std::size_t bad_line = 0;
  for_each_line(text, [&](std::string_view line, std::size_t number) {
    if (next_field(line) != wanted + ":") return true;
    found = parse_numbers<12>(line);
    if (!found) bad_line = number;
    return found.has_value();
  });
  if (bad_line != 0) return fail(errc::malformed, at_line(where, bad_line), "a projection matrix must have 12 numbers");
  if (!found) return fail(errc::malformed, where.string(), wanted + " is missing");
  const auto& p = *found;
  if (const auto k = camera::plausible({0, 0, p[0], p[5], p[2], p[6]}, where.string()); !k) return fail(k.error());
  return p;
}

/// Parses `calib.txt`: projection matrices `P<number>:` of 12 numbers. Errors: malformed (a matrix is missing or
/// invalid, or the cameras are not a rectified pair).
template <class = void>
[[nodiscard]] result<kitti_calibration> parse_kitti_calibration(std::string_view text, int left, int right,
                                                                const std::filesystem::path& where) {
  const auto l = parse_kitti_projection(text, left, where), r = parse_kitti_projection(text, right, where);
  if (!l) return fail(l.error());
  if (!r) return fail(r.error());
  const auto& p = *l;
  const kitti_calibration k{p[0], p[5], p[2], p[6], (p[3] - (*r)[3]) / p[0], kitti_place(p)};
  const auto differs = [&](std::size_t i) { return std::abs(p[i] - (*r)[i]) > 1e-6 * std::abs(p[0]); };
  if (differs(0) || differs(2) || differs(5) || differs(6) || !(k.baseline > 0.0 && k.baseline < 1e6))
    return fail(errc::malformed, where.string(), "the two cameras are not a rectified pair with the left camera first");
  return k;
}

/// Parses a file of poses: the first three rows of `T_world_camera`, 12 numbers per line. The entry of a lost pose
/// (`is_lost_pose`) is empty. Errors: malformed, with the line number (not 12 numbers, not a rigid transform).
template <class = void>
[[nodiscard]] result<std::vector<std::optional<se3>>> parse_kitti_poses(std::string_view text,
                                                                        const std::filesystem::path& where) {
  std::vector<std::optional<se3>> poses;
  std::optional<error> problem;
  for_each_line(text, [&](std::string_view line, std::size_t number) {
    if (is_lost_pose(line)) {
      poses.emplace_back();
      return true;
    }
    auto pose = parse_pose_matrix(std::string{line} + " 0 0 0 1", where);
    if (pose)
      poses.push_back(*pose);
    else
      problem = error{errc::malformed, at_line(where, number), pose.error().message};
    return !problem;
  });
  if (problem) return fail(*std::move(problem));
  return poses;
}

/// The poses of the camera with the pose `T_first_camera` in the frame of camera 0, from `poses.txt` in the sequence's
/// folder or from the benchmark's file in `../../poses`; empty if neither exists. Adds the file to `index.files`.
/// Adds notes if poses are lost, and if the number of poses differs from `times`, the number of time stamps. Errors:
/// unreadable, malformed (with the line number).
template <class = void>
[[nodiscard]] result<std::vector<std::optional<se3>>> read_kitti_poses(const std::filesystem::path& folder,
                                                                       const se3& T_first_camera, std::size_t times,
                                                                       recording_index& index) {
  const auto name = std::filesystem::absolute(folder / "").lexically_normal().parent_path().filename().string();
  for (const auto& file : {folder / "poses.txt", folder / ".." / ".." / "poses" / (name + ".txt")}) {
    if (!present(file)) continue;
    const auto text = read_file(file);
    if (!text) return fail(text.error());
    auto poses = parse_kitti_poses(*text, file);
    if (!poses) return fail(poses.error());
    index.files.push_back(file);
    if (poses->size() != times)
      index.notes.push_back(file.string() + ": " + std::to_string(poses->size()) + " poses for " +
                            std::to_string(times) + " time stamps");
    std::size_t lost = 0;
    for (std::optional<se3>& pose : *poses)
      if (pose)
        pose = *pose * T_first_camera;
      else
        ++lost;
    if (lost != 0) index.notes.push_back(lost_frames_note(lost, poses->size()));
    return poses;
  }
  return std::vector<std::optional<se3>>{};
}

/// Adds frame `n` with its time and, if known, its pose.
template <class = void>
void add_kitti_frame(std::size_t n, const std::vector<double>& times, const std::vector<std::optional<se3>>& poses,
                     const std::filesystem::path& color, const std::filesystem::path& depth, recording_index& index) {
  index.frames.push_back({times[n], color, depth, {}});
  if (n >= poses.size() || !poses[n]) return;
  index.frames.back().T_world_camera = poses[n];
  index.ground_truth.push_back({times[n], *poses[n]});
}

/// Sorts the frames of a sequence by time; of several frames with the same number, keeps the first. `images`: the
/// cameras' folders. Errors: no_data, and those of `check_first_frame`.
template <class = void>
[[nodiscard]] result<void> sort_kitti_frames(const std::vector<std::filesystem::path>& images, std::size_t times,
                                             recording_index& index) {
  const auto folder = images.front().parent_path();
  if (index.frames.empty()) {
    std::string content;
    for (const auto& path : images) content += path.filename().string() + " " + describe_content(path) + ", ";
    return fail(errc::no_data, folder.string(),
                "no frames: images must be named 000000.png and so on, one per time in times.txt (" +
                    std::to_string(times) + " times), with the same names for both cameras; " +
                    content.erase(content.size() - 2));
  }
  const auto keep_first = [](auto& list) {
    const auto earlier = [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; };
    const auto same = [](const auto& a, const auto& b) { return a.timestamp == b.timestamp; };
    std::stable_sort(list.begin(), list.end(), earlier);
    list.erase(std::unique(list.begin(), list.end(), same), list.end());
  };
  const std::size_t all = index.frames.size();
  keep_first(index.frames);
  keep_first(index.ground_truth);
  if (const std::size_t twice = all - index.frames.size(); twice != 0)
    index.notes.push_back(std::to_string(twice) + " images with a repeated number are skipped");
  return check_first_frame(index, folder);
}

/// The indices of the left and right cameras whose folders exist, preferably the grey ones. Empty if there are none.
template <class = void>
[[nodiscard]] std::optional<std::pair<int, int>> kitti_cameras(const std::filesystem::path& folder) {
  for (const auto& [left, right] : {std::pair{0, 1}, std::pair{2, 3}})
    if (present(folder / ("image_" + std::to_string(left))) && present(folder / ("image_" + std::to_string(right))))
      return std::pair{left, right};
  return std::nullopt;
}

/// Returns true if `folder` looks like a KITTI odometry sequence.
template <class = void>
[[nodiscard]] bool is_kitti(const std::filesystem::path& folder) {
  return kitti_cameras(folder) && present(folder / "calib.txt");
}

/// The index of a sequence. Images without a partner or a time are skipped and noted. Errors: not_found (a folder, a
/// file), unreadable, malformed (with file and line), no_data (no pair); and errors from reading the first image,
/// which determines the image size.
template <class = void>
[[nodiscard]] result<stereo_index> index_kitti(const std::filesystem::path& folder) {
  const auto cameras = kitti_cameras(folder);
  if (!cameras)
    return fail(errc::not_found, folder.string(), "has no folders image_0 and image_1, or image_2 and image_3");
  const auto left = folder / ("image_" + std::to_string(cameras->first));
  const auto right = folder / ("image_" + std::to_string(cameras->second));
  stereo_index index;
  recording_index& images = index.images;
  images.files = {folder / "calib.txt", folder / "times.txt"};
  const auto calibration_text = read_file(images.files[0]), times_text = read_file(images.files[1]);
  if (!calibration_text) return fail(calibration_text.error());
  if (!times_text) return fail(times_text.error());
  const auto k = parse_kitti_calibration(*calibration_text, cameras->first, cameras->second, images.files[0]);
  if (!k) return fail(k.error());
  const auto times = parse_times(*times_text, images.files[1]);
  if (!times) return fail(times.error());

  const auto poses = read_kitti_poses(folder, k->T_first_left, times->size(), images);
  if (!poses) return fail(poses.error());

  std::size_t lonely = 0;
  for (const auto& image : list_folder(left)) {
    std::size_t n = 0;
    if (!is_image_name(image) || !parse_number(image.stem().string(), n)) continue;
    if (n >= times->size() || !present(right / image.filename())) {
      ++lonely;
      continue;
    }
    add_kitti_frame(n, *times, *poses, image, right / image.filename(), images);
  }
  if (lonely != 0)
    images.notes.push_back(std::to_string(lonely) + " left images have no right image or no time and are skipped");
  if (const auto ok = sort_kitti_frames({left, right}, times->size(), images); !ok) return fail(ok.error());
  const auto first = read_color(images.frames.front().color);
  if (!first) return fail(first.error());
  const auto checked =
      camera::plausible({first->width(), first->height(), k->fx, k->fy, k->cx, k->cy}, (folder / "calib.txt").string());
  if (!checked) return fail(checked.error());
  const camera::pinhole camera{*checked};
  index.cameras = {camera, camera, se3{so3{}, vec3{k->baseline, 0.0, 0.0}}};
  index.fps = 10.0;
  return index;
}

}  // namespace orbis::io::detail

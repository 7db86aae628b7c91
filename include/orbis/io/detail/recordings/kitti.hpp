// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Sequences of the KITTI odometry benchmark: `image_0` and `image_1` (or `image_2` and `image_3`), `calib.txt`,
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
#include <orbis/core/file.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>
#include <orbis/io/detail/recordings/seven_scenes.hpp>
#include <orbis/io/detail/recordings/stereo_index.hpp>
#include <orbis/io/detail/text.hpp>
#include <orbis/io/image.hpp>

namespace orbis::io::detail {

/// The numbers in one line, at most `N`. Empty if there are not exactly `N`, or one is not finite.
template <std::size_t N>
[[nodiscard]] std::optional<std::array<double, N>> numbers_of(std::string_view line) {
  std::array<double, N> all{};
  for (double& value : all)
    if (!parse_number(next_field(line), value) || !std::isfinite(value)) return std::nullopt;
  return trimmed(line).empty() ? std::optional{all} : std::nullopt;
}

/// The camera of a rectified pair: focal lengths, principal point, and metres between the two.
struct kitti_calibration {
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0, baseline = 0.0;
};

/// The text of `calib.txt`: projection matrices `P<number>:` of 12 numbers. Errors: malformed (a matrix is missing or
/// is none, or the cameras do not stand side by side).
[[nodiscard]] inline result<kitti_calibration> parse_kitti_calibration(std::string_view text, int left, int right,
                                                                       const std::filesystem::path& where) {
  std::optional<std::array<double, 12>> found[2];
  std::size_t bad_line = 0;
  for_each_line(text, [&](std::string_view line, std::size_t number) {
    const std::string_view name = next_field(line);
    for (const int i : {0, 1}) {
      if (name != "P" + std::to_string(i == 0 ? left : right) + ":") continue;
      found[i] = numbers_of<12>(line);
      if (!found[i]) bad_line = number;
    }
    return bad_line == 0;
  });
  if (bad_line != 0) return fail(errc::malformed, at_line(where, bad_line), "a projection matrix has 12 numbers");
  for (const int i : {0, 1})
    if (!found[i])
      return fail(errc::malformed, where.string(), "P" + std::to_string(i == 0 ? left : right) + " is missing");
  const auto &l = *found[0], &r = *found[1];
  const kitti_calibration k{l[0], l[5], l[2], l[6], (l[3] - r[3]) / l[0]};
  const auto differs = [&](std::size_t i) { return std::abs(l[i] - r[i]) > 1e-6 * std::abs(l[0]); };
  if (!(k.fx > 0.0 && k.fy > 0.0 && k.fx < 1e9 && k.fy < 1e9 && std::abs(k.cx) < 1e9 && std::abs(k.cy) < 1e9))
    return fail(errc::malformed, where.string(), "a focal length must be above zero");
  if (differs(0) || differs(2) || differs(5) || differs(6) || !(k.baseline > 0.0 && k.baseline < 1e6))
    return fail(errc::malformed, where.string(), "the two cameras are not a rectified pair, the left one first");
  return k;
}

/// The text of `times.txt`: seconds, one a line. Errors: malformed, with the line (no number, or not ascending).
[[nodiscard]] inline result<std::vector<double>> parse_kitti_times(std::string_view text,
                                                                   const std::filesystem::path& where) {
  std::vector<double> times;
  std::size_t bad_line = 0;
  for_each_line(text, [&](std::string_view line, std::size_t number) {
    const auto t = numbers_of<1>(line);
    if (!t || (!times.empty() && !((*t)[0] > times.back()))) return bad_line = number, false;
    times.push_back((*t)[0]);
    return true;
  });
  if (bad_line != 0) return fail(errc::malformed, at_line(where, bad_line), "a line has one time, later than the last");
  return times;
}

/// The text of a file of poses: the first three rows of `T_world_camera`, 12 numbers a line. Errors: malformed, with
/// the line (not 12 numbers, no rigid transform).
[[nodiscard]] inline result<std::vector<se3>> parse_kitti_poses(std::string_view text,
                                                                const std::filesystem::path& where) {
  std::vector<se3> poses;
  std::optional<error> problem;
  for_each_line(text, [&](std::string_view line, std::size_t number) {
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

/// The folders of the left and right images, and the numbers of these cameras; grey ones first. Empty if there are
/// none.
[[nodiscard]] inline std::optional<std::pair<int, int>> kitti_cameras(const std::filesystem::path& folder) {
  for (const auto& [left, right] : {std::pair{0, 1}, std::pair{2, 3}})
    if (present(folder / ("image_" + std::to_string(left))) && present(folder / ("image_" + std::to_string(right))))
      return std::pair{left, right};
  return std::nullopt;
}

/// Whether `folder` looks like a sequence of KITTI odometry.
[[nodiscard]] inline bool is_kitti(const std::filesystem::path& folder) {
  return kitti_cameras(folder) && present(folder / "calib.txt");
}

/// The index of a sequence. Images without a partner or a time are left out and noted. Errors: not_found (a folder, a
/// file), unreadable, malformed (with file and line), no_data (no pair); those of the first image, which tells the
/// size.
[[nodiscard]] inline result<stereo_index> index_kitti(const std::filesystem::path& folder) {
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
  const auto times = parse_kitti_times(*times_text, images.files[1]);
  if (!times) return fail(times.error());

  std::vector<se3> poses;
  const auto name = std::filesystem::absolute(folder / "").lexically_normal().parent_path().filename().string();
  for (const auto& file : {folder / "poses.txt", folder / ".." / ".." / "poses" / (name + ".txt")}) {
    if (!present(file)) continue;
    const auto text = read_file(file);
    if (!text) return fail(text.error());
    auto read = parse_kitti_poses(*text, file);
    if (!read) return fail(read.error());
    poses = *std::move(read);
    images.files.push_back(file);
    break;
  }
  if (!poses.empty() && poses.size() != times->size())
    images.notes.push_back(images.files.back().string() + ": " + std::to_string(poses.size()) + " poses for " +
                           std::to_string(times->size()) + " times");

  std::size_t lonely = 0;
  for (const auto& image : list_folder(left)) {
    std::size_t n = 0;
    if (!parse_number(image.stem().string(), n)) continue;
    if (n >= times->size() || !present(right / image.filename())) {
      ++lonely;
      continue;
    }
    images.frames.push_back({(*times)[n], image, right / image.filename(), {}});
    if (n < poses.size()) {
      images.frames.back().T_world_camera = poses[n];
      images.ground_truth.push_back({(*times)[n], poses[n]});
    }
  }
  if (lonely != 0)
    images.notes.push_back(std::to_string(lonely) + " left images have no right image or no time and are left out");
  const auto earlier = [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; };
  std::sort(images.frames.begin(), images.frames.end(), earlier);
  std::sort(images.ground_truth.begin(), images.ground_truth.end(), earlier);
  if (const auto ok = check_first_frame(images, folder); !ok) return fail(ok.error());
  const auto first = read_color(images.frames.front().color);
  if (!first) return fail(first.error());
  const camera::pinhole camera{first->width(), first->height(), k->fx, k->fy, k->cx, k->cy};
  index.cameras = {camera, camera, se3{so3{}, vec3{k->baseline, 0.0, 0.0}}};
  index.fps = 10.0;
  return index;
}

}  // namespace orbis::io::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Recordings in the ASL layout of EuRoC MAV and TUM-VI: `mav0/cam0` and `mav0/cam1`, each with `data.csv`, `data/` and
/// `sensor.yaml`, and `mav0/state_groundtruth_estimate0` (or `mocap0`).
///
/// Source: M. Burri et al., "The EuRoC micro aerial vehicle datasets", IJRR 35 (2016). Times are in nanoseconds. The
/// poses are those of the body; `T_BS` in `sensor.yaml` is the pose of a sensor in the body frame.
#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/camera/plausible.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/quote.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/io/detail/files/plain_yaml.hpp>
#include <orbis/io/detail/files/pose_matrix.hpp>
#include <orbis/io/detail/files/pose_text.hpp>
#include <orbis/io/detail/recordings/recording_folder.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>
#include <orbis/io/detail/recordings/stereo_index.hpp>
#include <orbis/io/detail/recordings/tum.hpp>
#include <orbis/io/detail/text.hpp>
#include <orbis/io/trajectory_reading.hpp>

namespace orbis::io::detail {

/// A camera and its pose in the body frame.
struct asl_camera {
  camera::any_camera model;
  se3 T_body_camera;
  double rate = 20.0;  ///< images per second
};

/// Parses a camera's `sensor.yaml`. Errors: malformed (with file and line), unsupported (an unknown model).
template <class = void>
[[nodiscard]] result<asl_camera> parse_asl_camera(std::string_view text, const std::filesystem::path& where) {
  const auto yaml = plain_yaml::parse(text, where);
  if (!yaml) return fail(yaml.error());
  const auto reject = [&](std::string why) { return fail(errc::malformed, where.string(), std::move(why)); };
  const auto model = yaml->text("camera_model"), distortion = yaml->text("distortion_model");
  const auto size = yaml->numbers("resolution", 2), f = yaml->numbers("intrinsics", 4),
             T = yaml->numbers("T_BS.data", 16);
  const auto d = yaml->numbers("distortion_coefficients");
  for (const auto* read : {&model, &distortion})
    if (!*read) return fail(read->error());
  for (const auto* read : {&size, &f, &T, &d})
    if (!*read) return fail(read->error());
  const auto is_size = [](double v) { return v >= 1.0 && v <= 1e5 && v == std::floor(v); };
  if (!is_size((*size)[0]) || !is_size((*size)[1])) return reject("resolution must be two whole numbers up to 100000");
  const auto checked = camera::plausible(
      {static_cast<int>((*size)[0]), static_cast<int>((*size)[1]), (*f)[0], (*f)[1], (*f)[2], (*f)[3]}, where.string());
  if (!checked) return fail(checked.error());
  const camera::intrinsics& k = *checked;
  if (*model != "pinhole")
    return fail(errc::unsupported, where.string(), "camera_model " + in_quotes(*model) + " is not pinhole");
  const auto lens = [&]() -> result<camera::any_camera> {
    const std::vector<double>& c = *d;
    if (*distortion == "radial-tangential" || *distortion == "radtan") {
      if (c.size() != 4 && c.size() != 5)
        return reject("distortion_coefficients must have 4 or 5 values for radial-tangential");
      return camera::any_camera{camera::radial_tangential{k, {c[0], c[1], c[2], c[3], c.size() == 5 ? c[4] : 0.0}}};
    }
    if (*distortion == "equidistant") {
      if (c.size() != 4) return reject("distortion_coefficients must have 4 values for equidistant");
      return camera::any_camera{camera::kannala_brandt{k, {c[0], c[1], c[2], c[3]}}};
    }
    if (*distortion == "none") return camera::any_camera{camera::pinhole{k}};
    return fail(errc::unsupported, where.string(),
                "distortion_model " + in_quotes(*distortion) + " is not one of radial-tangential, equidistant, none");
  }();
  if (!lens) return fail(lens.error());
  std::string matrix = yaml->text("T_BS.data").value();
  std::replace_if(
      matrix.begin(), matrix.end(), [](char c) { return c == ',' || c == '[' || c == ']'; }, ' ');
  const auto pose = parse_pose_matrix(matrix, where);
  if (!pose) return reject("T_BS: " + pose.error().message);
  asl_camera camera{*lens, *pose};
  if (yaml->contains("rate_hz")) {
    const auto rate = yaml->numbers("rate_hz", 1);
    if (!rate) return fail(rate.error());
    if (!((*rate)[0] > 0.0 && (*rate)[0] < 1e9)) return reject("rate_hz must be a number above zero");
    camera.rate = (*rate)[0];
  }
  return camera;
}

/// Parses the ground truth's `data.csv`: nanoseconds, position and quaternion (w first) of the body; further columns
/// are ignored. Lost poses and repeated times are handled and noted as in `parse_trajectory_file`. Errors: malformed,
/// with the line number; degenerate.
template <class = void>
[[nodiscard]] result<trajectory_reading> parse_asl_poses(std::string_view text, const std::filesystem::path& where) {
  auto lines = parse_pose_lines(text, where, {.quaternion = 4, .w_first = true, .nanoseconds = true});
  if (!lines) return fail(lines.error());
  return order_poses(*std::move(lines), where);
}

/// The folder that contains `cam0` and `cam1`; empty if there is none.
template <class = void>
[[nodiscard]] std::filesystem::path asl_root(const std::filesystem::path& folder) {
  for (const auto& root : {folder / "mav0", folder})
    for (const char* const part : {"sensor.yaml", "data.csv", "data"})
      if (present(root / "cam0" / part)) return root;
  return {};
}

/// Returns true if `folder` looks like a recording in the ASL layout with two cameras.
template <class = void>
[[nodiscard]] bool is_asl(const std::filesystem::path& folder) {
  const auto root = asl_root(folder);
  return !root.empty() && present(root / "cam1");
}

/// A camera and its images.
struct asl_images {
  asl_camera camera;
  std::vector<stamped_file> files;
};

/// Reads `sensor.yaml` and `data.csv` from a camera's folder and adds both to `to.files`. Errors: not_found (a file),
/// unreadable, no_data, malformed (with file and line), unsupported.
template <class = void>
[[nodiscard]] result<asl_images> read_asl_images(const std::filesystem::path& where, recording_index& to) {
  std::string missing;
  for (const char* const name : {"sensor.yaml", "data.csv"})
    if (!present(where / name)) missing += (missing.empty() ? "" : " and ") + std::string{name};
  if (!missing.empty())
    return fail(errc::not_found, where.string(),
                "a camera in the ASL layout (EuRoC) needs " + missing + "; the folder " + describe_content(where));
  const auto settings = read_file(where / "sensor.yaml", plain_yaml::max_bytes), list = read_file(where / "data.csv");
  if (!settings) return fail(settings.error());
  if (!list) return fail(list.error());
  auto camera = parse_asl_camera(*settings, where / "sensor.yaml");
  if (!camera) return fail(camera.error());
  auto files = parse_image_list(*list, where / "data.csv", where / "data", to.notes, time_units[3]);
  if (!files) return fail(files.error());
  to.files.insert(to.files.end(), {where / "sensor.yaml", where / "data.csv"});
  return asl_images{*std::move(camera), *std::move(files)};
}

/// Reads the ground truth next to the cameras' folders, if it exists, converts it to poses of a camera, and sets the
/// poses of the frames of `index`. Errors: unreadable, malformed (with file and line).
template <class = void>
[[nodiscard]] result<void> read_asl_truth(const std::filesystem::path& root, const se3& T_body_camera,
                                          recording_index& index) {
  for (const char* const name : {"state_groundtruth_estimate0", "mocap0"}) {
    const auto file = root / name / "data.csv";
    if (!present(file)) continue;
    const auto text = read_file(file);
    if (!text) return fail(text.error());
    if (auto taken = take_ground_truth(parse_asl_poses(*text, file), index); !taken) return fail(taken.error());
    for (stamped_pose& p : index.ground_truth) p.T_world_camera = p.T_world_camera * T_body_camera;
    index.files.push_back(file);
    attach_ground_truth(index, 0.02);
    break;
  }
  return {};
}

/// The index of a recording in the ASL layout. Images are paired within `max_time_difference` seconds; images without a
/// partner are noted. Errors: not_found (a file), unreadable, no_data, malformed (with file and line), unsupported.
template <class = void>
[[nodiscard]] result<stereo_index> index_asl(const std::filesystem::path& folder, double max_time_difference) {
  const auto root = asl_root(folder);
  if (root.empty())
    return fail(errc::not_found, (folder / "mav0" / "cam0").string(), "no such folder; it must contain sensor.yaml");
  stereo_index index;
  const auto left = read_asl_images(root / "cam0", index.images);
  if (!left) return fail(left.error());
  const auto right = read_asl_images(root / "cam1", index.images);
  if (!right) return fail(right.error());
  if (auto paired = pair_images(left->files, right->files, folder, max_time_difference, index.images); !paired)
    return fail(paired.error());
  index.cameras = {left->camera.model, right->camera.model,
                   left->camera.T_body_camera.inverse() * right->camera.T_body_camera};
  index.fps = left->camera.rate;
  if (auto truth = read_asl_truth(root, left->camera.T_body_camera, index.images); !truth) return fail(truth.error());
  return index;
}

}  // namespace orbis::io::detail

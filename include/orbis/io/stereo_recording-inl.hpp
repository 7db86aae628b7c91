// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of stereo_recording.hpp.
#pragma once

#include <algorithm>
#include <cassert>

#include <orbis/core/file.hpp>
#include <orbis/io/detail/recordings/asl.hpp>
#include <orbis/io/detail/recordings/image_names.hpp>
#include <orbis/io/detail/recordings/kitti.hpp>
#include <orbis/io/detail/recordings/recording_camera.hpp>
#include <orbis/io/detail/recordings/recording_folder.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>
#include <orbis/io/detail/recordings/seven_scenes.hpp>
#include <orbis/io/detail/recordings/tum.hpp>
#include <orbis/io/detail/text.hpp>
#include <orbis/io/image.hpp>
#include <orbis/io/stereo_recording.hpp>

namespace orbis::io {
namespace detail {

// A plain folder of stereo images: the lists `left.txt` (or `rgb.txt`) and `right.txt` in the TUM format, or numbered
// images in `left` (or `rgb`) and `right`; `camera.toml`, and optionally `groundtruth.txt`.
//
// Rectified images have one camera, with its `baseline`. Unrectified images have a second camera in
// `camera_right.toml`, and its pose in `T_left_right.txt`: a 4x4 matrix from the right camera's frame to the left
// camera's frame, metres.

/// Returns true if `folder` looks like a plain folder of stereo images.
template <class = void>
[[nodiscard]] bool is_image_pairs(const std::filesystem::path& folder) {
  const bool lists = present(folder / "right.txt") && !first_present(folder, {"left.txt", "rgb.txt"}).empty();
  return lists || (present(folder / "right") && !first_present(folder, {"left", "rgb"}).empty());
}

/// The images in `folder`, ordered by name (`order_by_name`). Errors: no_data.
template <class = void>
[[nodiscard]] result<std::vector<stamped_file>> named_images(const std::filesystem::path& folder, double fps,
                                                             std::vector<std::string>& notes) {
  const keyed_images images = order_by_name(images_in(folder));
  if (images.paths.empty() || images.keys_are == image_keys::alphabet)
    return fail(errc::no_data, folder.string(),
                "no images with numbers (000000.png) or times as names; the folder " + describe_content(folder));
  note_order(folder, images, true, notes);
  return in_order_of_time(folder, images.stamped(fps), notes);
}

/// The index of a plain folder of stereo images. The camera `given` replaces `camera.toml`. Errors: not_found (a file),
/// unreadable, no_data, malformed (with file and line), invalid_argument (no camera, or no baseline).
template <class = void>
[[nodiscard]] result<stereo_index> index_image_pairs(const std::filesystem::path& folder, double max_time_difference,
                                                     const std::optional<camera::camera_settings>& given) {
  stereo_index index;
  recording_index& images = index.images;
  const auto right_file = folder / "camera_right.toml", place_file = folder / "T_left_right.txt";
  const auto camera = given_camera(folder, given, images.files);
  if (!camera) return fail(camera.error());
  if (!*camera) return fail(unknown_camera(folder));
  index.fps = (*camera)->fps;
  index.shutter = (*camera)->shutter;
  if (present(right_file)) {
    const auto right = read_camera(right_file);
    if (!right) return fail(right.error());
    const auto text = read_file(place_file);
    if (!text) return fail(text.error());
    const auto T_left_right = parse_pose_matrix(*text, place_file);
    if (!T_left_right) return fail(T_left_right.error());
    index.cameras = {(*camera)->model, right->model, *T_left_right};
    images.files.insert(images.files.end(), {right_file, place_file});
  } else {
    if (!(*camera)->baseline)
      return fail(errc::invalid_argument, folder.string(),
                  "the baseline is not known: add baseline to camera.toml, or add camera_right.toml and "
                  "T_left_right.txt");
    index.cameras = {(*camera)->model, (*camera)->model, se3{so3{}, vec3{*(*camera)->baseline, 0.0, 0.0}}};
  }

  std::vector<stamped_file> lists[2];
  bool have_whole_times = true;
  for (const int i : {0, 1}) {
    const auto list = i == 0 ? first_present(folder, {"left.txt", "rgb.txt"}) : first_present(folder, {"right.txt"});
    const auto numbered = i == 0 ? first_present(folder, {"left", "rgb"}) : folder / "right";
    auto files =
        list.empty() ? named_images(numbered, (*camera)->fps, images.notes) : read_image_list(list, images.notes);
    if (!files) return fail(files.error());
    lists[i] = *std::move(files);
    if (!list.empty()) images.files.push_back(list);
    have_whole_times = have_whole_times && !list.empty() && are_whole(timestamps(lists[i]));
  }
  if (auto paired = pair_images(lists[0], lists[1], folder, max_time_difference, images); !paired)
    return fail(paired.error());
  if (have_whole_times) convert_frame_numbers(images, index.fps);
  if (const auto truth = read_ground_truth(folder, max_time_difference, images, index.fps); !truth)
    return fail(truth.error());
  return index;
}

}  // namespace detail

ORBIS_LAZY_INLINE stereo_recording::stereo_recording(detail::stereo_index index, camera::rectification straight,
                                                     stereo_format format)
    : index_{std::move(index)}, straight_{std::move(straight)}, format_{format} {
  assert(!index_.images.frames.empty());
  const so3& turn = straight_.R_left_rectified();
  const auto turned = [&](const se3& pose) { return se3{pose.rotation() * turn, pose.translation()}; };
  if (straight_.is_identity()) return;
  for (stamped_pose& p : index_.images.ground_truth) p.T_world_camera = turned(p.T_world_camera);
  for (detail::recording_entry& f : index_.images.frames)
    if (f.T_world_camera) f.T_world_camera = turned(*f.T_world_camera);
}

ORBIS_LAZY_INLINE std::vector<std::filesystem::path> stereo_recording::files() const {
  std::vector<std::filesystem::path> all = index_.images.files;
  for (const auto& entry : index_.images.frames) all.insert(all.end(), {entry.color, entry.depth});
  return all;
}

ORBIS_LAZY_INLINE result<camera::stereo_frame> stereo_recording::frame(std::size_t i) const {
  auto a = left(i);
  if (!a) return fail(a.error());
  const auto& entry = index_.images.frames[i];
  auto b = read(entry.depth, index_.cameras.right);
  if (!b) return fail(b.error());
  if (!straight_.is_identity()) b = straight_.right().bilinear(b->view());
  return camera::stereo_frame{entry.timestamp, *std::move(a), *std::move(b), entry.T_world_camera};
}

ORBIS_LAZY_INLINE result<image<rgb8>> stereo_recording::left(std::size_t i) const {
  assert(i < size());
  auto a = read(index_.images.frames[i].color, index_.cameras.left);
  if (a && !straight_.is_identity()) a = straight_.left().bilinear(a->view());
  return a;
}

ORBIS_LAZY_INLINE result<image<rgb8>> stereo_recording::read(const std::filesystem::path& path,
                                                             const camera::any_camera& camera) {
  return detail::sized(read_color(path), path, camera.width(), camera.height());
}

ORBIS_LAZY_INLINE stereo_format detect_stereo_format(const std::filesystem::path& folder) {
  if (detail::is_asl(folder)) return stereo_format::asl;
  if (detail::is_kitti(folder)) return stereo_format::kitti;
  if (detail::is_image_pairs(folder)) return stereo_format::pairs;
  return stereo_format::automatic;
}

ORBIS_LAZY_INLINE result<stereo_recording> open_stereo_recording(const std::filesystem::path& folder,
                                                                 const stereo_recording_options& options) {
  if (const auto is_folder = detail::check_folder(folder); !is_folder) return fail(is_folder.error());
  const stereo_format format =
      options.format == stereo_format::automatic ? detect_stereo_format(folder) : options.format;
  const bool has_cameras = format == stereo_format::kitti || format == stereo_format::asl;
  const char* const cameras = format == stereo_format::kitti ? "calib.txt" : "sensor.yaml";
  if (has_cameras && options.camera)
    return fail(errc::invalid_argument, folder.string(),
                std::string{"the two cameras are those in "} + cameras + "; remove the camera from the options");
  const auto read_index = [&]() -> result<detail::stereo_index> {
    switch (format) {
      case stereo_format::kitti: return detail::index_kitti(folder);
      case stereo_format::asl: return detail::index_asl(folder, options.max_time_difference);
      case stereo_format::pairs: return detail::index_image_pairs(folder, options.max_time_difference, options.camera);
      case stereo_format::automatic: break;
    }
    return fail(detail::unknown_recording(folder,
                                          "image_0, image_1 and calib.txt (KITTI), mav0/cam0 and mav0/cam1 (ASL, "
                                          "EuRoC), left.txt and right.txt or images "
                                          "in left and right"));
  };
  auto index = read_index();
  if (!index) return fail(index.error());
  if (const auto unused = folder / "camera.toml"; has_cameras && detail::present(unused))
    index->images.notes.push_back(unused.string() + ": not used; the two cameras are those in " + cameras);
  detail::note_interval(index->images, index->fps);
  // Check the size before computing the rectification maps, because a wrong size may exhaust the memory.
  const auto& file = index->images.frames.front().color;
  const camera::any_camera& left = index->cameras.left;
  if (const auto first = detail::sized(read_color(file), file, left.width(), left.height()); !first)
    return fail(first.error());
  auto straight = camera::rectify(index->cameras, options.rectify);
  if (!straight) return fail(straight.error().code, folder.string(), straight.error().message);
  return stereo_recording(*std::move(index), *std::move(straight), format);
}

}  // namespace orbis::io

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Recordings of one camera: the colour images of the TUM, KITTI and ASL layouts, and plain folders of images.
#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/plausible.hpp>
#include <orbis/camera/settings.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/io/detail/recordings/asl.hpp>
#include <orbis/io/detail/recordings/image_names.hpp>
#include <orbis/io/detail/recordings/kitti.hpp>
#include <orbis/io/detail/recordings/recording_folder.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>
#include <orbis/io/detail/recordings/tum.hpp>
#include <orbis/io/detail/text.hpp>
#include <orbis/io/image.hpp>

namespace orbis::io::detail {

/// Maximum time between a pose and an image, seconds, if the poses are in a separate file.
inline constexpr double mono_pose_distance = 0.020;

// --- lists in the TUM layout --------------------------------------------------------------------

/// The list of a camera's images; empty if there is none.
template <class = void>
[[nodiscard]] std::filesystem::path find_image_list(const std::filesystem::path& folder) {
  return first_present(folder, {"rgb.txt", "left.txt"});
}

/// The index of the images listed in `rgb.txt` or `left.txt`. `fps`: frame rate, used if the list has frame numbers
/// instead of times. Errors: not_found, unreadable, no_data, malformed (ground truth, with its line).
template <class = void>
[[nodiscard]] result<recording_index> index_image_list(const std::filesystem::path& folder, double fps) {
  recording_index index;
  auto list = find_image_list(folder);
  if (list.empty()) list = folder / "rgb.txt";  // to name it in the error
  const auto files = read_image_list(list, index.notes);
  if (!files) return fail(files.error());
  index.files.push_back(list);
  for (const stamped_file& f : *files) index.frames.push_back({f.timestamp, f.path, {}, {}});
  if (const auto ok = check_first_frame(index, folder); !ok) return fail(ok.error());
  convert_frame_numbers(index, fps);
  if (const auto truth = read_ground_truth(folder, mono_pose_distance, index, fps); !truth) return fail(truth.error());
  guess_tum_camera(folder, index);
  return index;
}

// --- ASL (EuRoC) --------------------------------------------------------------------------------

/// The folder with `sensor.yaml` and `data.csv`: `folder` itself, or `cam0` of a recording; empty if there is none.
template <class = void>
[[nodiscard]] std::filesystem::path asl_camera_folder(const std::filesystem::path& folder) {
  if (present(folder / "sensor.yaml") && present(folder / "data.csv") && present(folder / "data")) return folder;
  const auto root = asl_root(folder);
  return root.empty() ? root : root / "cam0";
}

/// The index of one camera in a recording in the ASL layout. Errors: those of `index_asl`.
template <class = void>
[[nodiscard]] result<recording_index> index_asl_camera(const std::filesystem::path& folder) {
  auto where = asl_camera_folder(folder);
  if (where.empty()) where = folder / "mav0" / "cam0";
  recording_index index;
  const auto images = read_asl_images(where, index);
  if (!images) return fail(images.error());
  for (const stamped_file& f : images->files) index.frames.push_back({f.timestamp, f.path, {}, {}});
  if (const auto ok = check_first_frame(index, where); !ok) return fail(ok.error());
  const auto root = std::filesystem::absolute(where / "").lexically_normal().parent_path().parent_path();
  if (auto truth = read_asl_truth(root, images->camera.T_body_camera, index); !truth) return fail(truth.error());
  index.camera = camera::camera_settings{.model = images->camera.model, .fps = images->camera.rate};
  return index;
}

// --- KITTI --------------------------------------------------------------------------------------

/// Index of the first camera of a KITTI sequence that has images: left before right, grey before colour.
template <class = void>
[[nodiscard]] std::optional<int> kitti_camera(const std::filesystem::path& folder) {
  for (const int i : {0, 2, 1, 3})
    if (present(folder / ("image_" + std::to_string(i)))) return i;
  return std::nullopt;
}

/// Returns true if `folder` looks like a KITTI odometry sequence with at least one camera.
template <class = void>
[[nodiscard]] bool is_kitti_camera(const std::filesystem::path& folder) {
  return kitti_camera(folder) && present(folder / "calib.txt");
}

/// The index of one camera of a sequence. The poses in the file are those of camera 0; they are converted to this
/// camera. Errors: those of `index_kitti`.
template <class = void>
[[nodiscard]] result<recording_index> index_kitti_camera(const std::filesystem::path& folder) {
  const auto camera = kitti_camera(folder);
  if (!camera) return fail(errc::not_found, folder.string(), "has no folder image_0, image_1, image_2 or image_3");
  recording_index index;
  index.files = {folder / "calib.txt", folder / "times.txt"};
  const auto calibration_text = read_file(index.files[0]), times_text = read_file(index.files[1]);
  if (!calibration_text) return fail(calibration_text.error());
  if (!times_text) return fail(times_text.error());
  const auto projection = parse_kitti_projection(*calibration_text, *camera, index.files[0]);
  if (!projection) return fail(projection.error());
  const auto& p = *projection;
  const auto times = parse_times(*times_text, index.files[1]);
  if (!times) return fail(times.error());
  const auto poses = read_kitti_poses(folder, kitti_place(p), times->size(), index);
  if (!poses) return fail(poses.error());

  std::size_t lonely = 0;
  const auto images = folder / ("image_" + std::to_string(*camera));
  for (const auto& image : list_folder(images)) {
    std::size_t n = 0;
    if (!is_image_name(image) || !parse_number(image.stem().string(), n)) continue;
    if (n < times->size())
      add_kitti_frame(n, *times, *poses, image, {}, index);
    else
      ++lonely;
  }
  if (lonely != 0) index.notes.push_back(std::to_string(lonely) + " images have no time and are skipped");
  if (const auto ok = sort_kitti_frames({images}, times->size(), index); !ok) return fail(ok.error());
  const auto first = read_color(index.frames.front().color);
  if (!first) return fail(first.error());
  const auto k = camera::plausible({first->width(), first->height(), p[0], p[5], p[2], p[6]}, index.files[0].string());
  if (!k) return fail(k.error());
  index.camera = camera::camera_settings{.model = camera::pinhole{*k}, .fps = 10.0};
  return index;
}

// --- plain folders ------------------------------------------------------------------------------

/// The folder with the most images: `folder` itself, or a subfolder with one of the usual names; empty if there are no
/// images.
template <class = void>
[[nodiscard]] std::filesystem::path find_image_folder(const std::filesystem::path& folder) {
  std::filesystem::path found;
  std::size_t most = 0;
  for (const auto& path : {folder, folder / "rgb", folder / "color", folder / "colour", folder / "image",
                           folder / "images", folder / "left", folder / "data"})
    if (const std::size_t count = images_in(path).size(); count > most) found = path, most = count;
  return found;
}

/// The index of a plain folder with PNG or JPEG images, in the folder itself or in its subfolder `rgb`, `color`,
/// `colour`, `image`, `images`, `left` or `data`. The names of the images determine their order (`order_by_name`);
/// their times are those in `times.txt` or `timestamps.txt` (one per line), or in the names. `fps`: frame rate of
/// numbered images. Errors: no_data, unreadable, malformed (with file and line).
template <class = void>
[[nodiscard]] result<recording_index> index_image_folder(const std::filesystem::path& folder, double fps) {
  recording_index index;
  const auto where = find_image_folder(folder);
  if (where.empty())
    return fail(
        errc::no_data, folder.string(),
        "no PNG or JPEG images in it, nor in rgb, color, images, left or data; the folder " + describe_content(folder));
  const keyed_images images = order_by_name(images_in(where));
  std::vector<stamped_file> files = images.stamped(fps);
  if (const auto read = read_image_times(folder, files, index); !read) return fail(read.error());
  note_order(where, images, !index.files.empty(), index.notes);
  note_unused_folders(folder, {where}, index.notes);
  auto ordered = in_order_of_time(where, std::move(files), index.notes);
  if (!ordered) return fail(ordered.error());
  for (const stamped_file& f : *ordered) index.frames.push_back({f.timestamp, f.path, {}, {}});
  if (const auto truth = read_ground_truth(folder, mono_pose_distance, index, fps); !truth) return fail(truth.error());
  return index;
}

}  // namespace orbis::io::detail

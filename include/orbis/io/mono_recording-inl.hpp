// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of mono_recording.hpp.
#pragma once

#include <cassert>
#include <utility>

#include <orbis/io/detail/recordings/one_camera.hpp>
#include <orbis/io/detail/recordings/recording_camera.hpp>
#include <orbis/io/detail/recordings/recording_folder.hpp>
#include <orbis/io/image.hpp>
#include <orbis/io/mono_recording.hpp>
#include <orbis/io/recording.hpp>

namespace orbis::io {

ORBIS_LAZY_INLINE mono_recording::mono_recording(detail::recording_index index, camera::camera_settings camera,
                                                 mono_format format)
    : index_{std::move(index)}, camera_{std::move(camera)}, format_{format} {
  assert(!index_.frames.empty());
}

ORBIS_LAZY_INLINE std::vector<std::filesystem::path> mono_recording::files() const {
  std::vector<std::filesystem::path> all = index_.files;
  for (const detail::recording_entry& entry : index_.frames) all.push_back(entry.color);
  return all;
}

ORBIS_LAZY_INLINE result<camera::mono_frame> mono_recording::frame(std::size_t i) const {
  auto image = color(i);
  if (!image) return fail(image.error());
  const detail::recording_entry& entry = index_.frames[i];
  return camera::mono_frame{entry.timestamp, *std::move(image), entry.T_world_camera};
}

ORBIS_LAZY_INLINE result<image<rgb8>> mono_recording::color(std::size_t i) const {
  assert(i < size());
  const std::filesystem::path& file = index_.frames[i].color;
  return detail::sized(read_color(file), file, camera_.model.width(), camera_.model.height());
}

ORBIS_LAZY_INLINE mono_format detect_mono_format(const std::filesystem::path& folder) {
  if (!detail::asl_camera_folder(folder).empty()) return mono_format::asl;
  if (detail::is_kitti_camera(folder)) return mono_format::kitti;
  if (!detail::find_image_list(folder).empty()) return mono_format::tum;
  if (detect_format(folder) != recording_format::automatic) return mono_format::rgbd;
  if (!detail::find_image_folder(folder).empty()) return mono_format::images;
  return mono_format::automatic;
}

ORBIS_LAZY_INLINE result<mono_recording> open_mono_recording(const std::filesystem::path& folder,
                                                             const mono_recording_options& options) {
  if (const auto is_folder = detail::check_folder(folder); !is_folder) return fail(is_folder.error());
  std::vector<std::filesystem::path> files;
  auto camera = detail::given_camera(folder, options.camera, files);
  if (!camera) return fail(camera.error());
  const bool is_given = camera->has_value();
  const double fps = is_given ? (*camera)->fps : camera::camera_settings{}.fps;
  const mono_format format = options.format == mono_format::automatic ? detect_mono_format(folder) : options.format;
  const auto read_index = [&]() -> result<detail::recording_index> {
    switch (format) {
      case mono_format::tum: return detail::index_image_list(folder, fps);
      case mono_format::kitti: return detail::index_kitti_camera(folder);
      case mono_format::asl: return detail::index_asl_camera(folder);
      case mono_format::rgbd: {
        recording_format with_depth = recording_format::automatic;
        return detail::index_recording(folder, with_depth, recording_options{}.max_time_difference, fps);
      }
      case mono_format::images: return detail::index_image_folder(folder, fps);
      case mono_format::automatic: break;
    }
    return fail(detail::unknown_recording(
        folder,
        "rgb.txt (TUM), image_0 or image_2 with calib.txt (KITTI), mav0/cam0 (ASL, EuRoC), PNG or JPEG images in the "
        "folder or in rgb, color, images, left or data"));
  };
  auto index = read_index();
  if (!index) return fail(index.error());
  index->files.insert(index->files.end(), files.begin(), files.end());
  if (const auto known = detail::complete_camera(folder, *camera, *index); !known) return fail(known.error());
  if (!is_given && index->color) (*camera)->model = index->color->model;  // colour images are not resampled
  return mono_recording(*std::move(index), **std::move(camera), format);
}

}  // namespace orbis::io

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of recording.hpp.
#pragma once

#include <cassert>

#include <orbis/camera/pinhole.hpp>
#include <orbis/io/detail/recordings/color_registration.hpp>
#include <orbis/io/detail/recordings/icl_nuim.hpp>
#include <orbis/io/detail/recordings/image_folders.hpp>
#include <orbis/io/detail/recordings/recording_camera.hpp>
#include <orbis/io/detail/recordings/recording_folder.hpp>
#include <orbis/io/detail/recordings/scannet.hpp>
#include <orbis/io/detail/recordings/seven_scenes.hpp>
#include <orbis/io/detail/recordings/tum.hpp>
#include <orbis/io/image.hpp>
#include <orbis/io/recording.hpp>

namespace orbis::io {

ORBIS_LAZY_INLINE recording::recording(detail::recording_index index, camera::camera_settings camera,
                                       recording_format format)
    : index_{std::move(index)}, camera_{std::move(camera)}, format_{format} {
  assert(!index_.frames.empty());
  if (const auto* depth = camera_.model.get_if<camera::pinhole>(); index_.color && depth != nullptr)
    registration_ = std::make_shared<const detail::color_registration>(*index_.color, *depth);
}

ORBIS_LAZY_INLINE std::vector<std::filesystem::path> recording::files() const {
  std::vector<std::filesystem::path> all = index_.files;
  for (const detail::recording_entry& entry : index_.frames) all.insert(all.end(), {entry.color, entry.depth});
  return all;
}

ORBIS_LAZY_INLINE result<camera::rgbd_frame> recording::frame(std::size_t i) const {
  assert(i < size());
  const detail::recording_entry& entry = index_.frames[i];
  auto depth = read_sized_depth(entry.depth);
  if (!depth) return fail(depth.error());
  auto image = read_registered(entry.color, depth->view());
  if (!image) return fail(image.error());
  return camera::rgbd_frame{.timestamp = entry.timestamp,
                            .depth_timestamp = entry.depth_timestamp,
                            .color = *std::move(image),
                            .depth = *std::move(depth),
                            .depth_scale = camera_.depth_scale,
                            .T_world_camera = entry.T_world_camera};
}

ORBIS_LAZY_INLINE result<image<rgb8>> recording::color(std::size_t i) const {
  assert(i < size());
  const detail::recording_entry& entry = index_.frames[i];
  if (!registration_ || !registration_->needs_depth()) return read_registered(entry.color, {});
  const auto depth = read_sized_depth(entry.depth);
  if (!depth) return fail(depth.error());
  return read_registered(entry.color, depth->view());
}

ORBIS_LAZY_INLINE void recording::iterator::read() {
  frame_.reset();
  if (i_ == of_->size()) return;
  auto frame = of_->frame(i_);
  if (frame)
    frame_ = std::make_shared<const camera::rgbd_frame>(*std::move(frame));
  else
    of_->status_ = fail(std::move(frame.error()));
}

ORBIS_LAZY_INLINE result<image<std::uint16_t>> recording::read_sized_depth(const std::filesystem::path& path) const {
  return detail::sized(read_depth(path), path, camera_.model.width(), camera_.model.height());
}

ORBIS_LAZY_INLINE result<image<rgb8>> recording::read_registered(const std::filesystem::path& path,
                                                                 image_view<const std::uint16_t> depth) const {
  const camera::intrinsics& k = registration_ ? registration_->color().k() : camera_.model.k();
  auto image = detail::sized(read_color(path), path, k.width, k.height);
  if (image && registration_) image = registration_->register_color(image->view(), depth, camera_.depth_scale);
  return image;
}

ORBIS_LAZY_INLINE recording_format detect_format(const std::filesystem::path& folder) {
  if (detail::is_icl_nuim(folder)) return recording_format::icl_nuim;
  if (detail::is_tum(folder)) return recording_format::tum;
  if (detail::is_seven_scenes(folder)) return recording_format::seven_scenes;
  if (detail::is_scannet(folder)) return recording_format::scannet;
  if (detail::is_image_folders(folder)) return recording_format::folders;
  return recording_format::automatic;
}

namespace detail {

ORBIS_LAZY_INLINE result<recording_index> index_recording(const std::filesystem::path& folder, recording_format& format,
                                                          double max_time_difference, double fps) {
  if (format == recording_format::automatic) format = detect_format(folder);
  switch (format) {
    case recording_format::tum: return index_tum(folder, max_time_difference, fps);
    case recording_format::seven_scenes: return index_seven_scenes(folder);
    case recording_format::icl_nuim: return index_icl_nuim(folder);
    case recording_format::scannet: return index_scannet(folder);
    case recording_format::folders: return index_image_folders(folder, max_time_difference, fps);
    case recording_format::automatic: break;
  }
  return fail(unknown_recording(folder,
                                "rgb.txt and depth.txt (TUM), images in rgb and depth (or color, image; aligned_depth, "
                                "depth_registered), frame-*.color.png (7-Scenes), color, depth and intrinsic_depth.txt "
                                "(ScanNet)"));
}

}  // namespace detail

ORBIS_LAZY_INLINE result<recording> open_recording(const std::filesystem::path& folder,
                                                   const recording_options& options) {
  if (const auto is_folder = detail::check_folder(folder); !is_folder) return fail(is_folder.error());
  std::vector<std::filesystem::path> files;
  auto camera = detail::given_camera(folder, options.camera, files);
  if (!camera) return fail(camera.error());

  recording_format format = options.format;
  auto index = detail::index_recording(folder, format, options.max_time_difference,
                                       *camera ? (*camera)->fps : camera::camera_settings{}.fps);
  if (!index) return fail(index.error());
  index->files.insert(index->files.end(), files.begin(), files.end());
  if (const auto known = detail::complete_camera(folder, *camera, *index); !known) return fail(known.error());
  if (index->color) {
    const auto size = [](const camera::intrinsics& k) {
      return std::to_string(k.width) + " x " + std::to_string(k.height);
    };
    index->notes.push_back("colour images of " + size(index->color->model.k()) +
                           " pixels are resampled to the view of the depth camera, " + size((*camera)->model.k()));
  }
  return recording(*std::move(index), **std::move(camera), format);
}

}  // namespace orbis::io

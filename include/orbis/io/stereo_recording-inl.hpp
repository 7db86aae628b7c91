// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions of stereo_recording.hpp.
#pragma once

#include <cassert>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <orbis/camera/settings.hpp>
#include <orbis/camera/stereo.hpp>
#include <orbis/camera/stereo_frame.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/io/detail/recordings/asl.hpp>
#include <orbis/io/detail/recordings/image_pairs.hpp>
#include <orbis/io/detail/recordings/kitti.hpp>
#include <orbis/io/detail/recordings/recording_folder.hpp>
#include <orbis/io/detail/recordings/sized_image.hpp>
#include <orbis/io/detail/recordings/stereo_index.hpp>
#include <orbis/io/image.hpp>
#include <orbis/io/stereo_recording.hpp>

namespace orbis::io {

ORBIS_INLINE stereo_recording::stereo_recording(detail::stereo_index index, camera::rectification straight,
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

ORBIS_INLINE std::vector<std::filesystem::path> stereo_recording::files() const {
  std::vector<std::filesystem::path> all = index_.images.files;
  for (const auto& entry : index_.images.frames) all.insert(all.end(), {entry.color, entry.depth});
  return all;
}

ORBIS_INLINE result<camera::stereo_frame> stereo_recording::frame(std::size_t i) const {
  auto a = left(i);
  if (!a) return fail(a.error());
  const auto& entry = index_.images.frames[i];
  auto b = read(entry.depth, index_.cameras.right);
  if (!b) return fail(b.error());
  if (!straight_.is_identity()) b = straight_.right().bilinear(b->view());
  return camera::stereo_frame{entry.timestamp, *std::move(a), *std::move(b), entry.T_world_camera};
}

ORBIS_INLINE result<image<rgb8>> stereo_recording::left(std::size_t i) const {
  assert(i < size());
  auto a = read(index_.images.frames[i].color, index_.cameras.left);
  if (a && !straight_.is_identity()) a = straight_.left().bilinear(a->view());
  return a;
}

ORBIS_INLINE result<image<rgb8>> stereo_recording::read(const std::filesystem::path& path,
                                                        const camera::any_camera& camera) {
  return detail::sized(read_color(path), path, camera.width(), camera.height());
}

ORBIS_INLINE stereo_format detect_stereo_format(const std::filesystem::path& folder) {
  if (detail::is_asl(folder)) return stereo_format::asl;
  if (detail::is_kitti(folder)) return stereo_format::kitti;
  if (detail::is_image_pairs(folder)) return stereo_format::pairs;
  return stereo_format::automatic;
}

ORBIS_INLINE result<stereo_recording> open_stereo_recording(const std::filesystem::path& folder,
                                                            const stereo_recording_options& options) {
  if (const auto is_folder = detail::check_folder(folder); !is_folder) return fail(is_folder.error());
  const stereo_format format =
      options.format == stereo_format::automatic ? detect_stereo_format(folder) : options.format;
  const bool has_cameras = format == stereo_format::kitti || format == stereo_format::asl;
  const char* const cameras = format == stereo_format::kitti ? "calib.txt" : "sensor.yaml";
  if (has_cameras && options.camera)
    return fail(errc::invalid_argument, folder.string(),
                std::string{"the two cameras are those of "} + cameras + ", no other one can be named");
  const auto read_index = [&]() -> result<detail::stereo_index> {
    switch (format) {
      case stereo_format::kitti: return detail::index_kitti(folder);
      case stereo_format::asl: return detail::index_asl(folder, options.max_time_difference);
      case stereo_format::pairs: return detail::index_image_pairs(folder, options.max_time_difference, options.camera);
      case stereo_format::automatic: break;
    }
    return fail(detail::unknown_recording(
        folder,
        "no known stereo recording: neither image_0, image_1 and calib.txt (KITTI), nor mav0/cam0 and "
        "mav0/cam1 (ASL, EuRoC), nor left.txt and right.txt or images in left and right"));
  };
  auto index = read_index();
  if (!index) return fail(index.error());
  if (const auto unused = folder / "camera.toml"; has_cameras && detail::present(unused))
    index->images.notes.push_back(unused.string() + ": not used, the two cameras are those of " + cameras);
  // Before the maps of the rectification are made, whose size a wrong number may put beyond all memory.
  const auto& file = index->images.frames.front().color;
  const camera::any_camera& left = index->cameras.left;
  if (const auto first = detail::sized(read_color(file), file, left.width(), left.height()); !first)
    return fail(first.error());
  auto straight = camera::rectify(index->cameras, options.rectify);
  if (!straight) return fail(straight.error().code, folder.string(), straight.error().message);
  return stereo_recording(*std::move(index), *std::move(straight), format);
}

}  // namespace orbis::io

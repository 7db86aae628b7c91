// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Stereo recordings on disk, whatever their format, as rectified pairs.
///
/// @code
///   const auto recording = orbis::io::open_stereo_recording(path).value();
///   for (std::size_t i = 0; i != recording.size(); ++i) {
///     const orbis::camera::stereo_frame pair = recording.frame(i).value();
///     slam.track(pair.timestamp, pair.left.view(), pair.right.view());
///   }
/// @endcode
#pragma once

#include <cassert>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <orbis/camera/settings.hpp>
#include <orbis/camera/stereo.hpp>
#include <orbis/camera/stereo_frame.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/io/detail/recordings/asl.hpp>
#include <orbis/io/detail/recordings/image_pairs.hpp>
#include <orbis/io/detail/recordings/kitti.hpp>
#include <orbis/io/detail/recordings/sized_image.hpp>
#include <orbis/io/detail/recordings/stereo_index.hpp>
#include <orbis/io/image.hpp>

namespace orbis::io {

/// The layouts of stereo recordings we read. `automatic`: look which one it is. `pairs`: `left.txt` and `right.txt`, or
/// numbered images in `left` and `right`, with `camera.toml`.
enum class stereo_format { automatic, kitti, asl, pairs };

/// The name of a format: "kitti", "asl", "pairs", "auto".
[[nodiscard]] constexpr std::string_view to_string(stereo_format format) noexcept {
  switch (format) {
    case stereo_format::automatic: return "auto";
    case stereo_format::kitti: return "kitti";
    case stereo_format::asl: return "asl";
    case stereo_format::pairs: return "pairs";
  }
  return "unknown";
}

struct stereo_recording_options {
  stereo_format format = stereo_format::automatic;
  std::optional<camera::camera_settings> camera{};  ///< instead of camera.toml; of `pairs` only
  double max_time_difference = 0.005;               ///< between a left and its right image, seconds
  camera::rectify_options rectify{};
};

/// A list of pairs that are read, and rectified if they are not, when asked for. Thread-safe.
class stereo_recording {
 public:
  /// @pre !index.images.frames.empty(); `straight` is of `index.cameras`
  stereo_recording(detail::stereo_index index, camera::rectification straight, stereo_format format)
      : index_{std::move(index)}, straight_{std::move(straight)}, format_{format} {
    assert(!index_.images.frames.empty());
    const so3& turn = straight_.R_left_rectified();
    const auto turned = [&](const se3& pose) { return se3{pose.rotation() * turn, pose.translation()}; };
    if (straight_.is_identity()) return;
    for (stamped_pose& p : index_.images.ground_truth) p.T_world_camera = turned(p.T_world_camera);
    for (detail::recording_entry& f : index_.images.frames)
      if (f.T_world_camera) f.T_world_camera = turned(*f.T_world_camera);
  }

  [[nodiscard]] std::size_t size() const noexcept { return index_.images.frames.size(); }
  /// Of the left image, seconds. @pre i < size()
  [[nodiscard]] double timestamp(std::size_t i) const { return index_.images.frames[i].timestamp; }
  /// The rectified camera of both images, with the baseline.
  [[nodiscard]] camera::camera_settings camera() const {
    return {
        .model = straight_.camera(), .fps = index_.fps, .baseline = straight_.baseline(), .shutter = index_.shutter};
  }
  /// The cameras as they are.
  [[nodiscard]] const camera::stereo_rig<camera::any_camera>& cameras() const noexcept { return index_.cameras; }
  [[nodiscard]] const camera::rectification& rectification() const noexcept { return straight_; }
  /// All poses of the ground truth, of the rectified left camera; empty if there is none.
  [[nodiscard]] const trajectory& ground_truth() const noexcept { return index_.images.ground_truth; }
  /// Never `automatic`.
  [[nodiscard]] stereo_format format() const noexcept { return format_; }
  /// What is worth a warning: images without a partner, lines left out.
  [[nodiscard]] std::span<const std::string> notes() const noexcept { return index_.images.notes; }
  /// Every file that the recording is read from: lists, poses, cameras, and all images.
  [[nodiscard]] std::vector<std::filesystem::path> files() const {
    std::vector<std::filesystem::path> all = index_.images.files;
    for (const auto& entry : index_.images.frames) all.insert(all.end(), {entry.color, entry.depth});
    return all;
  }

  /// Reads frame `i`. Errors: not_found, unreadable, malformed (damaged, or of another size than its camera's),
  /// unsupported. @pre i < size()
  [[nodiscard]] result<camera::stereo_frame> frame(std::size_t i) const {
    auto a = left(i);
    if (!a) return fail(a.error());
    const auto& entry = index_.images.frames[i];
    auto b = read(entry.depth, index_.cameras.right);
    if (!b) return fail(b.error());
    if (!straight_.is_identity()) b = straight_.right().bilinear(b->view());
    return camera::stereo_frame{entry.timestamp, *std::move(a), *std::move(b), entry.T_world_camera};
  }
  /// Reads the left image of frame `i` alone. Errors as above. @pre i < size()
  [[nodiscard]] result<image<rgb8>> left(std::size_t i) const {
    assert(i < size());
    auto a = read(index_.images.frames[i].color, index_.cameras.left);
    if (a && !straight_.is_identity()) a = straight_.left().bilinear(a->view());
    return a;
  }

 private:
  [[nodiscard]] static result<image<rgb8>> read(const std::filesystem::path& path, const camera::any_camera& camera) {
    return detail::sized(read_color(path), path, camera.width(), camera.height());
  }

  detail::stereo_index index_;
  camera::rectification straight_;
  stereo_format format_;
};

/// Which format the stereo recording in `folder` has; `automatic` if none is recognised.
[[nodiscard]] inline stereo_format detect_stereo_format(const std::filesystem::path& folder) {
  if (detail::is_asl(folder)) return stereo_format::asl;
  if (detail::is_kitti(folder)) return stereo_format::kitti;
  if (detail::is_image_pairs(folder)) return stereo_format::pairs;
  return stereo_format::automatic;
}

/// Opens the stereo recording in `folder`: reads its lists, poses and cameras, and rectifies the cameras; of its images
/// only the first left one, for its size.
/// Errors: not_found, unreadable, unsupported (no known format, or a camera of an unknown model), no_data (nothing in
/// it), malformed (with file and line; an image of another size than its camera's), invalid_argument (no camera known,
/// another camera for a format that has its own, or cameras that cannot be rectified).
[[nodiscard]] inline result<stereo_recording> open_stereo_recording(const std::filesystem::path& folder,
                                                                    const stereo_recording_options& options = {}) {
  std::error_code ignored;
  if (!detail::present(folder)) return fail(errc::not_found, folder.string(), "no such folder");
  if (!std::filesystem::is_directory(folder, ignored))
    return fail(errc::unsupported, folder.string(), "a recording is a folder, this is a file");
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

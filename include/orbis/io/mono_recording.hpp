// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Recordings of one camera without depth, whatever their format.
///
/// @code
///   const auto recording = orbis::io::open_mono_recording(path).value();
///   for (std::size_t i = 0; i != recording.size(); ++i) {
///     const orbis::camera::mono_frame frame = recording.frame(i).value();
///     ...
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

#include <orbis/camera/mono_frame.hpp>
#include <orbis/camera/settings.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/io/camera_file.hpp>
#include <orbis/io/detail/recordings/one_camera.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>
#include <orbis/io/detail/recordings/sized_image.hpp>
#include <orbis/io/image.hpp>
#include <orbis/io/recording.hpp>

namespace orbis::io {

/// The layouts of recordings that have the images of one camera. `automatic`: look which one it is. `tum`: a list
/// `rgb.txt` (or `left.txt`). `kitti`: `image_0` (or 2, 1, 3) with `calib.txt` and `times.txt`. `asl`: `mav0/cam0`, or
/// a camera's folder alone. `rgbd`: the colour images of what `open_recording` reads. `images`: a plain folder of
/// images.
enum class mono_format { automatic, tum, kitti, asl, rgbd, images };

/// The name of a format: "tum", "kitti", "asl", "rgbd", "images", "auto".
[[nodiscard]] constexpr std::string_view to_string(mono_format format) noexcept {
  switch (format) {
    case mono_format::automatic: return "auto";
    case mono_format::tum: return "tum";
    case mono_format::kitti: return "kitti";
    case mono_format::asl: return "asl";
    case mono_format::rgbd: return "rgbd";
    case mono_format::images: return "images";
  }
  return "unknown";
}

struct mono_recording_options {
  mono_format format = mono_format::automatic;
  std::optional<camera::camera_settings> camera{};  ///< instead of what the recording says
};

/// A list of images that are read when asked for. Thread-safe.
class mono_recording {
 public:
  /// @pre !index.frames.empty()
  mono_recording(detail::recording_index index, camera::camera_settings camera, mono_format format)
      : index_{std::move(index)}, camera_{std::move(camera)}, format_{format} {
    assert(!index_.frames.empty());
  }

  [[nodiscard]] std::size_t size() const noexcept { return index_.frames.size(); }
  /// Seconds. @pre i < size()
  [[nodiscard]] double timestamp(std::size_t i) const { return index_.frames[i].timestamp; }
  /// The file of image `i`. @pre i < size()
  [[nodiscard]] const std::filesystem::path& path(std::size_t i) const { return index_.frames[i].color; }
  [[nodiscard]] const camera::camera_settings& camera() const noexcept { return camera_; }
  /// All poses of the ground truth, not only those at frames; empty if there is none.
  [[nodiscard]] const trajectory& ground_truth() const noexcept { return index_.ground_truth; }
  /// Never `automatic`.
  [[nodiscard]] mono_format format() const noexcept { return format_; }
  /// What is worth a warning: lines left out, images without a time.
  [[nodiscard]] std::span<const std::string> notes() const noexcept { return index_.notes; }
  /// Every file that the recording is read from: lists, poses, camera, and all images.
  [[nodiscard]] std::vector<std::filesystem::path> files() const {
    std::vector<std::filesystem::path> all = index_.files;
    for (const detail::recording_entry& entry : index_.frames) all.push_back(entry.color);
    return all;
  }

  /// Reads frame `i`. Errors: not_found, unreadable, malformed (damaged, or of another size than the camera's),
  /// unsupported. @pre i < size()
  [[nodiscard]] result<camera::mono_frame> frame(std::size_t i) const {
    auto image = color(i);
    if (!image) return fail(image.error());
    const detail::recording_entry& entry = index_.frames[i];
    return camera::mono_frame{entry.timestamp, *std::move(image), entry.T_world_camera};
  }
  /// Reads the image of frame `i` alone. Errors as above. @pre i < size()
  [[nodiscard]] result<image<rgb8>> color(std::size_t i) const {
    assert(i < size());
    const std::filesystem::path& file = index_.frames[i].color;
    return detail::sized(read_color(file), file, camera_.model.width(), camera_.model.height());
  }

 private:
  detail::recording_index index_;
  camera::camera_settings camera_;
  mono_format format_;
};

/// Which format the images of one camera in `folder` have; `automatic` if none is recognised.
[[nodiscard]] inline mono_format detect_mono_format(const std::filesystem::path& folder) {
  if (!detail::asl_camera_folder(folder).empty()) return mono_format::asl;
  if (detail::is_kitti_camera(folder)) return mono_format::kitti;
  if (!detail::image_list_of(folder).empty()) return mono_format::tum;
  if (detect_format(folder) != recording_format::automatic) return mono_format::rgbd;
  if (!detail::image_folder_of(folder).empty()) return mono_format::images;
  return mono_format::automatic;
}

/// Opens the recording in `folder` as that of one camera: reads its lists, poses and camera, not yet its images (of
/// KITTI one, for its size). Depth and the images of further cameras are passed over.
///
/// The camera is the option's; else that of `camera.toml` in the folder; else what the format's own files or the
/// folder's name tell; else this fails.
/// Errors: not_found, unreadable, unsupported (no known format, or a camera of an unknown model), no_data (nothing in
/// it), malformed (with file and line), invalid_argument (no camera known).
[[nodiscard]] inline result<mono_recording> open_mono_recording(const std::filesystem::path& folder,
                                                                const mono_recording_options& options = {}) {
  std::error_code ignored;
  if (!detail::present(folder)) return fail(errc::not_found, folder.string(), "no such folder");
  if (!std::filesystem::is_directory(folder, ignored))
    return fail(errc::unsupported, folder.string(), "a recording is a folder, this is a file");
  std::optional<camera::camera_settings> camera = options.camera;
  std::optional<std::filesystem::path> camera_file;
  if (const auto file = folder / "camera.toml"; !camera && detail::present(file)) {
    auto read = read_camera(file);
    if (!read) return fail(read.error());
    camera = *std::move(read);
    camera_file = file;
  }
  const mono_format format = options.format == mono_format::automatic ? detect_mono_format(folder) : options.format;
  const auto read_index = [&]() -> result<detail::recording_index> {
    switch (format) {
      case mono_format::tum: return detail::index_image_list(folder);
      case mono_format::kitti: return detail::index_kitti_camera(folder);
      case mono_format::asl: return detail::index_asl_camera(folder);
      case mono_format::rgbd: {
        recording_format with_depth = recording_format::automatic;
        return detail::index_recording(folder, with_depth, recording_options{}.max_time_difference);
      }
      case mono_format::images: return detail::index_image_folder(folder, camera ? camera->fps : 30.0);
      case mono_format::automatic: break;
    }
    return fail(detail::unknown_recording(
        folder,
        "no known recording of one camera: neither rgb.txt (TUM), nor image_0 or image_2 with calib.txt (KITTI), nor "
        "mav0/cam0 (ASL, EuRoC), nor PNG or JPEG images in it or in rgb, color, images, left or data"));
  };
  auto index = read_index();
  if (!index) return fail(index.error());
  if (camera_file) index->files.push_back(*camera_file);
  if (!camera) camera = index->camera;
  if (!options.camera && !camera_file && index->color) camera->model = index->color->model;  // images as they are
  if (!camera)
    return fail(errc::invalid_argument, folder.string(),
                "the camera is not known: put a camera.toml into the folder, or name a camera");
  return mono_recording(*std::move(index), *std::move(camera), format);
}

}  // namespace orbis::io

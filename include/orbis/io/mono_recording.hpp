// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Recordings of one camera without depth, in any supported format.
///
/// @code
///   const auto recording = orbis::io::open_mono_recording(path).value();
///   for (std::size_t i = 0; i != recording.size(); ++i) {
///     const orbis::camera::mono_frame frame = recording.frame(i).value();
///     ...
///   }
/// @endcode
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <orbis/camera/mono_frame.hpp>
#include <orbis/camera/settings.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>

namespace orbis::io {

/// The supported layouts of recordings of one camera. `automatic`: the layout is detected. `tum`: a list `rgb.txt` (or
/// `left.txt`). `kitti`: a folder `image_0` ... `image_3` with `calib.txt` and `times.txt`. `asl`: `mav0/cam0`, or a
/// single camera's folder. `rgbd`: the colour images of recordings that `open_recording` reads. `images`: a plain
/// folder of images.
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
  std::optional<camera::camera_settings> camera{};  ///< replaces the camera of the recording
};

/// A list of images that are read on request. Thread-safe.
class mono_recording {
 public:
  /// @pre !index.frames.empty()
  ORBIS_LAZY mono_recording(detail::recording_index index, camera::camera_settings camera, mono_format format);

  [[nodiscard]] std::size_t size() const noexcept { return index_.frames.size(); }
  /// Time in seconds. @pre i < size()
  [[nodiscard]] double timestamp(std::size_t i) const { return index_.frames[i].timestamp; }
  /// The file of image `i`. @pre i < size()
  [[nodiscard]] const std::filesystem::path& path(std::size_t i) const { return index_.frames[i].color; }
  [[nodiscard]] const camera::camera_settings& camera() const noexcept { return camera_; }
  /// All ground-truth poses, not only those at the times of frames; empty if there is no ground truth.
  [[nodiscard]] const trajectory& ground_truth() const noexcept { return index_.ground_truth; }
  /// The format; never `automatic`.
  [[nodiscard]] mono_format format() const noexcept { return format_; }
  /// Warnings: skipped lines, images without a time stamp.
  [[nodiscard]] std::span<const std::string> notes() const noexcept { return index_.notes; }
  /// All files of the recording: lists, poses, camera, and all images.
  ORBIS_LAZY [[nodiscard]] std::vector<std::filesystem::path> files() const;

  /// Reads frame `i`. Errors: not_found, unreadable, malformed (damaged, or its size differs from the camera's),
  /// unsupported. @pre i < size()
  ORBIS_LAZY [[nodiscard]] result<camera::mono_frame> frame(std::size_t i) const;
  /// Reads only the image of frame `i`. Errors: those of `frame`. @pre i < size()
  ORBIS_LAZY [[nodiscard]] result<image<rgb8>> color(std::size_t i) const;

 private:
  detail::recording_index index_;
  camera::camera_settings camera_;
  mono_format format_;
};

/// Detects the format of the images of one camera in `folder`; `automatic` if none is recognised.
ORBIS_LAZY [[nodiscard]] mono_format detect_mono_format(const std::filesystem::path& folder);

/// Opens the recording in `folder` as a recording of one camera: reads its lists, poses and camera, but not its images
/// (except one image of a KITTI sequence, to determine the image size). Ignores depth and the images of other cameras.
///
/// The camera is taken from the first of these that specifies it: the options; `camera.toml` in the folder; the
/// format's own files, or the folder's name. If none does, the function fails.
/// Errors: not_found, unreadable, unsupported (no known format, or a camera of an unknown model), no_data (no images),
/// malformed (with file and line), invalid_argument (no camera known).
ORBIS_LAZY [[nodiscard]] result<mono_recording> open_mono_recording(const std::filesystem::path& folder,
                                                                    const mono_recording_options& options = {});

}  // namespace orbis::io

#ifndef ORBIS_COMPILED
#include <orbis/io/mono_recording-inl.hpp>
#endif

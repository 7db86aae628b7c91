// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Stereo recordings on disk as rectified pairs, in any supported format.
///
/// @code
///   const auto recording = orbis::io::open_stereo_recording(path).value();
///   for (std::size_t i = 0; i != recording.size(); ++i) {
///     const orbis::camera::stereo_frame pair = recording.frame(i).value();
///     slam.track(pair.timestamp, pair.left.view(), pair.right.view());
///   }
/// @endcode
#pragma once

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
#include <orbis/core/image.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/io/detail/recordings/stereo_index.hpp>

namespace orbis::io {

/// The supported layouts of stereo recordings. `automatic`: the layout is detected. `pairs`: `left.txt` and
/// `right.txt`, or numbered images in `left` and `right`, with `camera.toml`.
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
  std::optional<camera::camera_settings> camera{};  ///< replaces camera.toml; only for `pairs`
  double max_time_difference = 0.005;               ///< maximum time between a left image and its right image, seconds
  camera::rectify_options rectify{};
};

/// A list of pairs that are read, and rectified if necessary, on request. Thread-safe.
class stereo_recording {
 public:
  /// @pre !index.images.frames.empty(); `straight` is the rectification of `index.cameras`
  ORBIS_LAZY stereo_recording(detail::stereo_index index, camera::rectification straight, stereo_format format);

  [[nodiscard]] std::size_t size() const noexcept { return index_.images.frames.size(); }
  /// Time of the left image, seconds. @pre i < size()
  [[nodiscard]] double timestamp(std::size_t i) const { return index_.images.frames[i].timestamp; }
  /// The rectified camera of both images, with the baseline.
  [[nodiscard]] camera::camera_settings camera() const {
    return {
        .model = straight_.camera(), .fps = index_.fps, .baseline = straight_.baseline(), .shutter = index_.shutter};
  }
  /// The original cameras, before rectification.
  [[nodiscard]] const camera::stereo_rig<camera::any_camera>& cameras() const noexcept { return index_.cameras; }
  [[nodiscard]] const camera::rectification& rectification() const noexcept { return straight_; }
  /// All ground-truth poses, as poses of the rectified left camera; empty if there are none.
  [[nodiscard]] const trajectory& ground_truth() const noexcept { return index_.images.ground_truth; }
  /// The format; never `automatic`.
  [[nodiscard]] stereo_format format() const noexcept { return format_; }
  /// Warnings: images without a partner, skipped lines.
  [[nodiscard]] std::span<const std::string> notes() const noexcept { return index_.images.notes; }
  /// All files of the recording: lists, poses, cameras, and all images.
  ORBIS_LAZY [[nodiscard]] std::vector<std::filesystem::path> files() const;

  /// Reads frame `i`. Errors: not_found, unreadable, malformed (damaged, or its size differs from its camera's),
  /// unsupported. @pre i < size()
  ORBIS_LAZY [[nodiscard]] result<camera::stereo_frame> frame(std::size_t i) const;
  /// Reads only the left image of frame `i`. Errors: those of `frame`. @pre i < size()
  ORBIS_LAZY [[nodiscard]] result<image<rgb8>> left(std::size_t i) const;

 private:
  ORBIS_LAZY [[nodiscard]] static result<image<rgb8>> read(const std::filesystem::path& path,
                                                           const camera::any_camera& camera);

  detail::stereo_index index_;
  camera::rectification straight_;
  stereo_format format_;
};

/// Detects the format of the stereo recording in `folder`; `automatic` if none is recognised.
ORBIS_LAZY [[nodiscard]] stereo_format detect_stereo_format(const std::filesystem::path& folder);

/// Opens the stereo recording in `folder`: reads its lists, poses and cameras, and rectifies the cameras. The only
/// image that it reads is the first left one, to check its size. Errors: not_found, unreadable, unsupported (no known
/// format, or a camera of an unknown model), no_data (no pairs), malformed (with file and line; an image whose size
/// differs from its camera's), invalid_argument (no camera known, a camera option for a format with its own cameras, or
/// cameras that cannot be rectified).
ORBIS_LAZY [[nodiscard]] result<stereo_recording> open_stereo_recording(const std::filesystem::path& folder,
                                                                        const stereo_recording_options& options = {});

}  // namespace orbis::io

#ifndef ORBIS_COMPILED
#include <orbis/io/stereo_recording-inl.hpp>
#endif

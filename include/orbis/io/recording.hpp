// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// RGB-D recordings on disk, in any supported format.
///
/// @code
///   for (const auto& frame : orbis::io::open_recording(path).value()) slam.track(frame);
/// @endcode
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/camera/settings.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>

namespace orbis::io {

namespace detail {
class color_registration;
}

/// The supported layouts. `automatic`: the layout is detected. `folders`: colour images in `rgb`, `color`, `colour`,
/// `image` or `images`, depth images in `depth`, `aligned_depth` or `depth_registered`, paired by the numbers or times
/// in their names.
enum class recording_format { automatic, tum, seven_scenes, icl_nuim, scannet, folders };

/// The name of a format: "tum", "7scenes", "icl", "scannet", "folders", "auto".
[[nodiscard]] constexpr std::string_view to_string(recording_format format) noexcept {
  switch (format) {
    case recording_format::automatic: return "auto";
    case recording_format::tum: return "tum";
    case recording_format::seven_scenes: return "7scenes";
    case recording_format::icl_nuim: return "icl";
    case recording_format::scannet: return "scannet";
    case recording_format::folders: return "folders";
  }
  return "unknown";
}

struct recording_options {
  recording_format format = recording_format::automatic;
  std::optional<camera::camera_settings> camera{};  ///< replaces the camera of the recording
  double max_time_difference = 0.020;               ///< maximum time between a colour and its depth image, seconds
};

/// A list of frames that are read on request. `frame` is thread-safe; iterators are not.
class recording {
 public:
  /// @pre !index.frames.empty()
  ORBIS_LAZY recording(detail::recording_index index, camera::camera_settings camera, recording_format format);

  [[nodiscard]] std::size_t size() const noexcept { return index_.frames.size(); }
  /// Time of the colour image, seconds. @pre i < size()
  [[nodiscard]] double timestamp(std::size_t i) const { return index_.frames[i].timestamp; }
  [[nodiscard]] const camera::camera_settings& camera() const noexcept { return camera_; }
  /// All ground-truth poses, not only those at the times of frames; empty if there is no ground truth.
  [[nodiscard]] const trajectory& ground_truth() const noexcept { return index_.ground_truth; }
  /// The format; never `automatic`.
  [[nodiscard]] recording_format format() const noexcept { return format_; }
  /// Warnings: images without a partner, skipped lines, depth that is not registered.
  [[nodiscard]] std::span<const std::string> notes() const noexcept { return index_.notes; }
  /// All files of the recording: lists, poses, camera, and all images.
  ORBIS_LAZY [[nodiscard]] std::vector<std::filesystem::path> files() const;

  /// Reads frame `i`. Colour and depth have the camera's size. Errors: not_found, unreadable,
  /// malformed (damaged, or its size differs from the camera's), unsupported. @pre i < size()
  ORBIS_LAZY [[nodiscard]] result<camera::rgbd_frame> frame(std::size_t i) const;
  /// Reads only the colour image of frame `i`. Errors: those of `frame`. @pre i < size()
  ORBIS_LAZY [[nodiscard]] result<image<rgb8>> color(std::size_t i) const;

  /// Single-pass iterator that reads each frame as it advances. Iteration ends at the first frame that cannot be read;
  /// the recording's `status` then contains the reason. A reference to a frame is valid until the iterator advances.
  class iterator {
   public:
    using iterator_category = std::input_iterator_tag;
    using iterator_concept = std::input_iterator_tag;
    using value_type = camera::rgbd_frame;
    using difference_type = std::ptrdiff_t;
    using reference = const camera::rgbd_frame&;
    using pointer = const camera::rgbd_frame*;

    iterator() = default;
    ORBIS_LAZY explicit iterator(recording& of) : of_{&of} { read(); }
    [[nodiscard]] reference operator*() const { return *frame_; }
    [[nodiscard]] pointer operator->() const { return frame_.get(); }
    ORBIS_LAZY iterator& operator++() {
      ++i_;
      read();
      return *this;
    }
    ORBIS_LAZY void operator++(int) { ++*this; }
    [[nodiscard]] friend bool operator==(const iterator& it, std::default_sentinel_t) noexcept { return !it.frame_; }

   private:
    ORBIS_LAZY void read();

    recording* of_ = nullptr;
    std::size_t i_ = 0;
    std::shared_ptr<const camera::rgbd_frame> frame_;  // shared, so that an iterator can be copied
  };

  /// Restarts the iteration and clears `status`. The recording must outlive the iterator and must not be moved.
  ORBIS_LAZY [[nodiscard]] iterator begin() {
    status_ = {};
    return iterator(*this);
  }
  [[nodiscard]] std::default_sentinel_t end() const noexcept { return {}; }
  /// The error that ended the last iteration before the last frame, if any.
  [[nodiscard]] const result<void>& status() const noexcept { return status_; }

 private:
  ORBIS_LAZY [[nodiscard]] result<image<std::uint16_t>> read_sized_depth(const std::filesystem::path& path) const;
  /// Reads a colour image; resamples it to the depth camera if `registration_` is set.
  ORBIS_LAZY [[nodiscard]] result<image<rgb8>> read_registered(const std::filesystem::path& path,
                                                               image_view<const std::uint16_t> depth) const;

  detail::recording_index index_;
  camera::camera_settings camera_;
  recording_format format_;
  std::shared_ptr<const detail::color_registration> registration_;  // set if colour is resampled
  result<void> status_;
};

/// Detects the format of the recording in `folder`; `automatic` if none is recognised.
ORBIS_LAZY [[nodiscard]] recording_format detect_format(const std::filesystem::path& folder);

namespace detail {

/// The index of the recording in `folder`. If `format` is `automatic`, sets it to the detected format. `fps`: frame
/// rate of images without time stamps. Errors: those of `open_recording`.
ORBIS_LAZY [[nodiscard]] result<recording_index> index_recording(const std::filesystem::path& folder,
                                                                 recording_format& format, double max_time_difference,
                                                                 double fps);

}  // namespace detail

/// Opens the recording in `folder`: reads its lists, poses and camera, but not its images.
///
/// The camera is taken from the first of these that specifies it: the options; `camera.toml` in the folder; the
/// format's own files; the data set, for ICL-NUIM (`*.gt.freiburg`) and the TUM benchmark (`rgbd_dataset_freiburg1` ...
/// in the path), with a note. If none does, the function fails. A note reports a time between frames that does not
/// match the camera's frame rate. Errors: not_found, unreadable, unsupported (no known format), no_data (no frames),
/// malformed (with file and line), invalid_argument (no camera known).
ORBIS_LAZY [[nodiscard]] result<recording> open_recording(const std::filesystem::path& folder,
                                                          const recording_options& options = {});

}  // namespace orbis::io

#ifndef ORBIS_COMPILED
#include <orbis/io/recording-inl.hpp>
#endif

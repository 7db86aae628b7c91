// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Index that the readers of stereo recordings pass to `stereo_recording`: the cameras and the list of image pairs,
/// which are read later.
#pragma once

#include <optional>

#include <orbis/camera/any.hpp>
#include <orbis/camera/shutter.hpp>
#include <orbis/camera/stereo.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>

namespace orbis::io::detail {

/// A stereo recording without its image data.
struct stereo_index {
  /// In each frame `color` is the left image and `depth` the right one; poses are those of the left camera.
  recording_index images;
  camera::stereo_rig<camera::any_camera> cameras;
  double fps = 30.0;
  std::optional<camera::shutter> shutter{};  ///< shutter of both cameras, if known
};

}  // namespace orbis::io::detail

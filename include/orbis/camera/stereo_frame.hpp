// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One moment of a stereo camera.
#pragma once

#include <optional>

#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>

namespace orbis::camera {

/// The two images of a rectified stereo camera: of the same size, of the same pinhole camera, a row of one is that of
/// the other.
struct stereo_frame {
  double timestamp = 0.0;  ///< of both images, seconds
  image<rgb8> left;
  image<rgb8> right;
  std::optional<se3> T_world_camera;  ///< ground truth of the rectified left camera, where the recording has it
};

}  // namespace orbis::camera

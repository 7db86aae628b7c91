// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A frame of a stereo camera.
#pragma once

#include <optional>

#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>

namespace orbis::camera {

/// The images of a rectified stereo camera: same size, same pinhole model, and corresponding points in the same row.
struct stereo_frame {
  double timestamp = 0.0;  ///< time of both images, seconds
  image<rgb8> left;
  image<rgb8> right;
  std::optional<se3> T_world_camera;  ///< ground truth of the rectified left camera, if recorded
};

}  // namespace orbis::camera

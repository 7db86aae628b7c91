// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A frame of a monocular camera.
#pragma once

#include <optional>

#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>

namespace orbis::camera {

/// A time-stamped image of a camera without depth.
struct mono_frame {
  double timestamp = 0.0;  ///< seconds
  image<rgb8> color;
  std::optional<se3> T_world_camera;  ///< ground truth, if recorded
};

}  // namespace orbis::camera

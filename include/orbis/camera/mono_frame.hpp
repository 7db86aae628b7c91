// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One moment of a single camera.
#pragma once

#include <optional>

#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>

namespace orbis::camera {

/// The image of a camera without depth.
struct mono_frame {
  double timestamp = 0.0;  ///< seconds
  image<rgb8> color;
  std::optional<se3> T_world_camera;  ///< ground truth, where the recording has it
};

}  // namespace orbis::camera

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Trajectories: time-stamped poses.
#pragma once

#include <vector>

#include <orbis/core/se3.hpp>

namespace orbis {

/// Where the camera was at a moment: `T_world_camera` at `timestamp` seconds.
struct stamped_pose {
  double timestamp = 0.0;
  se3 T_world_camera;
};

/// Poses in the order of their time stamps.
using trajectory = std::vector<stamped_pose>;

}  // namespace orbis

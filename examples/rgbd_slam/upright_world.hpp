// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// World frames with z up, each defined by the first frame of a map.
#pragma once

#include <map>
#include <optional>

#include <orbis/camera/rays.hpp>
#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>

#include "results.hpp"
#include "settings.hpp"
#include "source.hpp"

namespace app {

class upright_worlds {
 public:
  upright_worlds(const frame_source& source, const settings& s);

  /// The pose of the camera at `frame` in the world frame that starts with this frame. With ground truth, this is the
  /// world frame of the ground truth, rotated if its z axis does not point up; without ground truth (or with positions
  /// only), the camera is at the origin and looks along x. The direction of gravity in the settings applies only to the
  /// very first frame (`is_first`).
  [[nodiscard]] orbis::se3 start_world(const orbis::camera::rgbd_frame& frame, bool is_first);
  /// The source of the vertical direction for the world frame that starts at `timestamp`; empty if no world frame
  /// starts then.
  [[nodiscard]] std::optional<world_results> world_starting_at(double timestamp) const;

 private:
  orbis::camera::ray_table rays_;
  std::optional<orbis::vec3> gravity_;
  bool follows_truth_;
  std::map<double, world_results> begun_;  // indexed by start time
};

}  // namespace app

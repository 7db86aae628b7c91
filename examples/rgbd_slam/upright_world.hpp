// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Worlds with z up, which begin with a frame.
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

  /// Where the camera is at `frame`, in the world that begins with it: the ground truth's if its z is up, or that
  /// turned until z is up; without ground truth the camera is at the origin and looks along x. What gravity the
  /// settings know is that of the very first frame (`is_first`).
  [[nodiscard]] orbis::se3 begin_with(const orbis::camera::rgbd_frame& frame, bool is_first);
  /// How up was found for the world that began with the frame of this time; nothing if none did.
  [[nodiscard]] std::optional<world_results> begun_at(double timestamp) const;

 private:
  orbis::camera::ray_table rays_;
  std::optional<orbis::vec3> gravity_;
  std::map<double, world_results> begun_;  // by time
};

}  // namespace app

// error: camera_model
// SPDX-License-Identifier: BSD-3-Clause
#include <optional>

#include <orbis/camera/rays.hpp>

struct half_a_camera {  // no projection with a Jacobian
  int width() const { return 640; }
  int height() const { return 480; }
  std::optional<orbis::vec2> project(const orbis::vec3&) const { return {}; }
  std::optional<orbis::vec3> unproject(const orbis::vec2&) const { return {}; }
};

orbis::camera::ray_table rays{half_a_camera{}};

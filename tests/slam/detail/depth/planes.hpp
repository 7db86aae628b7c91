// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Depth images of rooms that are made of planes.
#pragma once

#include <limits>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/slam/camera_rig.hpp>

namespace orbis::test {

/// The points `p` of the world with `normal . p = distance`; seen from where `normal . p` is less.
struct plane {
  vec3 normal;
  double distance;
};

[[nodiscard]] inline slam::camera_rig<camera::pinhole> small_rig() {
  return slam::make_rig(camera::pinhole{{320, 240, 262.5, 262.5, 159.5, 119.5}}, slam::options{});
}

/// Metres; 0 where no plane is seen.
[[nodiscard]] inline image<float> depth_of(const std::vector<plane>& planes, const se3& T_world_camera,
                                           const camera::pinhole& camera) {
  image<float> depth(camera.width(), camera.height());
  const mat3 turn = T_world_camera.rotation_matrix();
  for (int v = 0; v != depth.height(); ++v)
    for (int u = 0; u != depth.width(); ++u) {
      const vec3 ray = turn * *camera.unproject(vec2(u, v));
      double nearest = std::numeric_limits<double>::infinity();
      for (const plane& p : planes) {
        const double z = (p.distance - p.normal.dot(T_world_camera.translation())) / p.normal.dot(ray);
        if (z > 0.0 && z < nearest) nearest = z;
      }
      depth(u, v) = nearest < 1e3 ? static_cast<float>(nearest) : 0.0F;
    }
  return depth;
}

[[nodiscard]] inline camera::depth_view<float> metres(const image<float>& depth) {
  return camera::depth_view<float>{depth.view()};
}

/// A wall ahead; the same with a floor; the same with a second wall: all that a camera at the origin sees.
[[nodiscard]] inline std::vector<plane> wall() { return {{vec3(0, 0, 1), 2.0}}; }
[[nodiscard]] inline std::vector<plane> wall_and_floor() { return {{vec3(0, 0, 1), 2.0}, {vec3(0, 1, 0), 0.5}}; }
[[nodiscard]] inline std::vector<plane> corner() {
  return {{vec3(0, 0, 1), 2.0}, {vec3(0, 1, 0), 0.5}, {vec3(1, 0, 0.2).normalized(), 0.8}};
}

}  // namespace orbis::test

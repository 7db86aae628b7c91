// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A depth image as points in the world.
#pragma once

#include <cassert>
#include <cstddef>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/core/se3.hpp>

namespace orbis::octree {

/// Appends to `points` the world points (metres, rounded to float at the very end) of the pixels of
/// `depth` that hold a measurement and whose ray `camera` can un-project, row by row.
/// @pre depth and camera have the same size
template <camera::depth_source Depth, camera::camera_model Camera>
void append_world_points(const Depth& depth, const Camera& camera, const se3& T_world_camera,
                         std::vector<vec3f>& points) {
  assert(static_cast<int>(depth.width()) == static_cast<int>(camera.width()) &&
         static_cast<int>(depth.height()) == static_cast<int>(camera.height()));
  const mat3 rotation = T_world_camera.rotation_matrix();
  const vec3 translation = T_world_camera.translation();
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x) {
      const float z = depth(x, y);
      if (!(z > 0.0F)) continue;
      const auto ray = camera.unproject(vec2{static_cast<double>(x), static_cast<double>(y)});
      if (!ray) continue;
      const vec3 p = rotation * (static_cast<double>(z) * *ray) + translation;
      points.push_back(p.cast<float>());
    }
}

}  // namespace orbis::octree

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Renders what a camera would see of a map: depth images, labels, and voxels pixel by pixel.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <optional>
#include <type_traits>

#include <orbis/camera/model.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/octree/accessor.hpp>
#include <orbis/octree/cast_ray.hpp>

namespace orbis::octree {

/// Casts the ray of every pixel of a camera at `T_world_camera` and calls `visit(x, y, ray_hit)` for
/// each that has one, in no particular order and on the policy's threads, for no pixel twice. Unknown
/// space stops rays unless `options` say otherwise. O(pixels x voxels along a ray).
template <execution_policy Policy, octree_map Map, camera::camera_model Camera,
          std::invocable<int, int, const ray_hit&> Visit>
void render(const Policy& policy, const Map& map, const Camera& camera, const se3& T_world_camera,
            const ray_options& options, Visit&& visit) {
  const auto origin = coordinates<float>(T_world_camera.translation());
  const int width = camera.width();
  for_each_chunk(policy, static_cast<std::size_t>(camera.height()), 8, [&](std::size_t begin, std::size_t end) {
    ray_caster<typename Map::model> cast{map.store(), map.grid(), options};
    for (auto y = static_cast<int>(begin); y != static_cast<int>(end); ++y)
      for (int x = 0; x != width; ++x) {
        const std::optional<vec3> ray = camera.unproject(vec2{double(x), double(y)});
        if (!ray) continue;
        const vec3 direction = T_world_camera.rotation() * *ray;
        visit(x, y, cast(origin, coordinates<float>(direction)));
      }
  });
}

/// The depth image of the occupied voxels: metres along the optical axis to where the pixel's ray
/// enters the voxel it hits, 0 where it hits none. All policies give the same image.
template <execution_policy Policy, octree_map Map, camera::camera_model Camera>
[[nodiscard]] image<float> render_depth(const Policy& policy, const Map& map, const Camera& camera,
                                        const se3& T_world_camera, const ray_options& options = {}) {
  image<float> depth(camera.width(), camera.height());
  const vec3 origin = T_world_camera.translation();
  const double half = map.grid().resolution() / 2.0;
  render(policy, map, camera, T_world_camera, options, [&](int x, int y, const ray_hit& hit) {
    if (!hit) return;
    // The ray is scaled to depth 1, so that its parameter is the depth: enter by the last of three faces.
    const vec3 direction = T_world_camera.rotation() * *camera.unproject(vec2{double(x), double(y)});
    double enter = 0.0;
    for (int i = 0; i != 3; ++i)
      if (direction[i] != 0.0) {
        const double face = hit.point[i] - (direction[i] > 0.0 ? half : -half);
        enter = std::max(enter, (face - origin[i]) / direction[i]);
      }
    depth(x, y) = static_cast<float>(enter);
  });
  return depth;
}

/// Labels, or whatever else `label(const voxel_key&)` makes of the voxel that each pixel's ray hits;
/// `nothing` where it hits none. `label` is called on the policy's threads.
template <execution_policy Policy, octree_map Map, camera::camera_model Camera, std::invocable<const voxel_key&> Label>
[[nodiscard]] auto render_labels(const Policy& policy, const Map& map, const Camera& camera, const se3& T_world_camera,
                                 const ray_options& options, Label&& label,
                                 std::invoke_result_t<Label&, const voxel_key&> nothing = {})
    -> image<std::remove_cvref_t<std::invoke_result_t<Label&, const voxel_key&>>> {
  image<std::remove_cvref_t<std::invoke_result_t<Label&, const voxel_key&>>> labels(camera.width(), camera.height(),
                                                                                    nothing);
  render(policy, map, camera, T_world_camera, options, [&](int x, int y, const ray_hit& hit) {
    if (hit) labels(x, y) = label(hit.key);
  });
  return labels;
}

}  // namespace orbis::octree

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A depth image prepared for the descent through the octree.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/mark/depth/depth_descent.hpp>
#include <orbis/octree/detail/mark/depth/depth_pyramid.hpp>
#include <orbis/octree/detail/mark/depth/direction_index.hpp>
#include <orbis/octree/detail/mark/depth/endpoint_image.hpp>
#include <orbis/octree/detail/mark/depth/endpoint_rows.hpp>
#include <orbis/octree/detail/mark/depth/view_frame.hpp>
#include <orbis/octree/detail/mark/depth/voxel_ray_test.hpp>
#include <orbis/octree/detail/storage/scan_masks.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::octree::detail {

/// The view of a depth image: one ray per pixel. Fill `ends` and, for cameras other than pinholes, `map`, and then call
/// set_scene. See mark_image for the remaining steps.
template <class = void>
struct basic_depth_frame : view_frame {
  using sample_kernel = unsigned(const depth_scene&, const endpoint_image&, const child_offsets&, const float3&,
                                 const children&, unsigned);
  using test_kernel = bool(const endpoint_image&, const voxel_test&, const pixel_box&, float,
                           std::vector<std::uint32_t>&);

  chosen_kernel<sample_children_kernel, sample_kernel, simd::avx2> sample;
  chosen_kernel<test_pixels_kernel, test_kernel> test_pixels;
  endpoint_image ends;
  direction_index map;  ///< for cameras other than pinholes
  std::vector<descent_worker> workers;

  /// Computes the parameters of the tests. `ray_error`: maximum deviation of a ray from that of its pixel, at z = 1.
  /// @pre `ends` and, if needed, `map` belong to the image
  void set_scene(const depth_sensor& sensor, float ray_error = 0.0F) {
    const pixel_rays& rays = ends.rays();
    const int width = rays.width(), height = rays.height();
    if (rays.separable()) {
      scene.map = nullptr;
      const vec2f focal = rays.focal().cast<float>(), center = rays.center().cast<float>();
      set_view(sensor,
               {focal.x(), focal.y(), center.x(), center.y(), width, height, rays.x(0)[0], rays.x(0)[width - 1],
                *rays.y(0), *rays.y(height - 1)},
               ray_error);
    } else {
      scene.map = &map;
      set_view(sensor, {map.focal().x(), map.focal().y(), map.center().x(), map.center().y(), width, height,
                        map.min_x(), map.max_x(), map.min_y(), map.max_y()});
    }
    set_spacing(half_diagonal());
  }
  /// Returns true if the rays are so dense that testing voxels is faster than walking along rays. With less than one
  /// pixel per half voxel edge, most voxels would have to be tested individually.
  [[nodiscard]] bool is_dense(const end_counts& counts) const {
    return is_dense(counts.sum_z / static_cast<double>(counts.used + counts.truncated),
                    static_cast<double>(scene.voxel), static_cast<double>(std::max(scene.fx, scene.fy)));
  }
  /// Returns true if no ray is nearly parallel to the image plane. Otherwise neighbouring rays are far apart although
  /// their depths are small, and most voxels between them would have to be tested individually. For cameras whose rays
  /// are not separable, `map` limits the angle.
  [[nodiscard]] bool has_moderate_angles() const {
    constexpr float most = 20.0F;  // tangent of 87 degrees
    const pixel_rays& rays = ends.rays();
    if (!rays.separable()) return true;
    const auto is_moderate = [](float first, float last) { return std::max(std::abs(first), std::abs(last)) <= most; };
    return is_moderate(rays.x(0)[0], rays.x(0)[rays.width() - 1]) &&
           is_moderate(*rays.y(0), *rays.y(rays.height() - 1));
  }
  [[nodiscard]] static bool is_dense(double mean_z, double voxel, double focal) {
    return mean_z < 0.45 * voxel * focal;
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    std::size_t bytes = view_frame::memory_bytes() + ends.memory_bytes() + map.memory_bytes() +
                        workers.capacity() * sizeof(descent_worker);
    for (const descent_worker& w : workers) bytes += w.memory_bytes();
    return bytes;
  }
};
using depth_frame = basic_depth_frame<>;

/// Rays of a depth image for the descent.
struct depth_rays {
  const depth_frame& frame;
  const depth_sensor& sensor;
  const void* ends;
  ray_endpoint (*find_endpoint)(const void* ends, int u, int v);  ///< end of the ray of a pixel

  /// `end(u, v)` returns the ray_endpoint of a pixel.
  template <class End>
  depth_rays(const depth_frame& f, const depth_sensor& s, const End& end)
      : frame{f}, sensor{s}, ends{&end}, find_endpoint{[](const void* e, int u, int v) -> ray_endpoint {
          return (*static_cast<const End*>(e))(u, v);
        }} {}

  [[nodiscard]] unsigned sample(const child_offsets& o, const float3& world, const children& c, unsigned wanted) const {
    return frame.sample(frame.scene, frame.ends, o, world, c, wanted);
  }
  [[nodiscard]] bool test(const voxel_test& t, const pixel_box& box, float near_z,
                          std::vector<std::uint32_t>& unsure) const {
    return frame.test_pixels(frame.ends, t, box, near_z, unsure);
  }
  /// Returns true if a ray of `part`, a box in the tile of `size` x `size` pixels at (u, v), may cross the voxel.
  [[nodiscard]] bool may_cross(const voxel_test& t, const pixel_box& part, std::int32_t u, std::int32_t v,
                               std::int32_t size) const {
    const pixel_rays& rays = frame.ends.rays();
    if (rays.separable())
      return t.may_cross(rays.x(0)[part.u0], rays.x(0)[part.u1], *rays.y(part.v0), *rays.y(part.v1));
    const auto& tile = frame.map.tile_at(u, v, size);
    return tile.x0 <= tile.x1 && t.may_cross(tile.x0, tile.x1, tile.y0, tile.y1);
  }
  /// Traverses a ray for which `test` was undecided; returns true if it visits the voxel.
  [[nodiscard]] bool visits(std::uint32_t number, const voxel_key& voxel) const {
    const auto [u, v] = frame.ends.pixel(number);
    return crosses(sensor, find_endpoint(ends, u, v), voxel);
  }
};

/// Marks the voxels that the rays of a frame cross, see descend_nodes; `bounds`: see view_frame::ray_bounds; `end`: see
/// depth_rays. Returns view_frame::is_on_face: if true, the neighbours of the camera's voxel are not marked yet, see
/// first_voxels.
template <execution_policy Policy, class End, class Saturated>
[[nodiscard]] bool mark_image(const Policy& policy, depth_frame& frame, const depth_sensor& sensor, float max_z,
                              const std::pair<voxel_key, voxel_key>& bounds, const End& end, scan_masks& masks,
                              const Saturated& saturated) {
  const pixel_rays& rays = frame.ends.rays();
  frame.pyramid.build(rays.width(), rays.height(), max_z, [&](int v) { return frame.ends.z(v); });
  frame.list_nodes(sensor, bounds.first, bounds.second);
  const bool on_face = frame.is_on_face(sensor);
  descend_nodes(policy, frame, sensor, depth_rays{frame, sensor, end}, on_face, masks, saturated, frame.workers);
  return on_face;
}

}  // namespace orbis::octree::detail

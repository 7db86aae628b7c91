// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Finds the voxels that a depth image observes free and occupied. The voxels are found one by one by projection
/// instead of ray by ray, and are exactly those that the traversal of every ray finds.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/depth/depth_descent.hpp>
#include <orbis/octree/detail/depth/depth_frame.hpp>
#include <orbis/octree/detail/depth/depth_scan.hpp>
#include <orbis/octree/detail/depth/endpoint_rows.hpp>
#include <orbis/octree/detail/depth/first_steps.hpp>
#include <orbis/octree/detail/points/point_integrator.hpp>
#include <orbis/octree/detail/storage/node_name.hpp>
#include <orbis/octree/detail/storage/scan_masks.hpp>
#include <orbis/octree/integration.hpp>

namespace orbis::octree::detail {

/// Marks the voxels of depth images. Reuses its memory between images.
///
/// The octree is descended from a node around all rays. Nodes that no ray reaches are dropped, and nodes whose voxels
/// are all certainly crossed are filled; a min/max pyramid of the ray ends decides both. The remaining voxels are at
/// surfaces and at the border of the view: such a voxel is free if the ray of one of its pixels crosses it. If rounding
/// could change the result, the exact traversal of that ray decides.
class depth_integrator {
 public:
  /// Marks the voxels in `masks` that the every_ray integration of the image's world points marks (see
  /// append_world_points). Voxels that a miss would not change according to `saturated` may be missing from the free
  /// ones, and an occupied voxel may or may not be free as well. The summary's voxel counts stay zero. The same voxels
  /// under every policy.
  ///
  /// `saturated(name, mask)` sets the bits of such voxels of a named brick; it can be called from several threads.
  /// O(pixels + bricks seen + voxels at surfaces).
  /// @pre depth and camera have the same size
  template <execution_policy Policy>
  integration_summary mark(const Policy& policy, const voxel_grid& grid, const depth_scan& scan,
                           const se3& T_world_camera, const integration_options& options, scan_masks& masks,
                           const saturated_voxels& saturated = {}) {
    const depth_sensor sensor{grid, T_world_camera, options.max_range};
    masks.clear();
    const end_counts ends = frame_.ends.find_ends(policy, sensor, scan, masks);
    if (sensor.key && ends.leaves) {
      if (!frame_.ends.rays().separable()) frame_.map.fit(frame_.ends.rays());
      frame_.set_scene(sensor);
      const auto bounds = frame_.bounds_of(sensor, ends.max_z);
      if (bounds && frame_.is_dense(ends))
        mark_free(policy, sensor, scan, ends.max_z, *bounds, masks, saturated);
      else
        walk_all(policy, sensor, scan, T_world_camera, options, masks);
    }
    return {.used = ends.used, .truncated = ends.truncated, .rejected = ends.rejected};
  }
  /// Like `mark`, but finds only the occupied voxels.
  template <execution_policy Policy>
  integration_summary mark_ends(const Policy& policy, const voxel_grid& grid, const depth_scan& scan,
                                const se3& T_world_camera, const integration_options& options, scan_masks& masks) {
    const depth_sensor sensor{grid, T_world_camera, options.max_range};
    masks.clear();
    const end_counts ends = frame_.ends.find_ends(policy, sensor, scan, masks);
    return {.used = ends.used, .truncated = ends.truncated, .rejected = ends.rejected};
  }

  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    std::size_t bytes = frame_.memory_bytes() + walker_.memory_bytes() + points_.capacity() * sizeof(vec3f) +
                        workers_.capacity() * sizeof(descent_worker);
    for (const descent_worker& w : workers_) bytes += w.memory_bytes();
    return bytes;
  }

 private:
  // -- one frame

  template <class Policy>
  void mark_free(const Policy& policy, const depth_sensor& sensor, const depth_scan& scan, float max_z,
                 const std::pair<voxel_key, voxel_key>& bounds, scan_masks& masks, const saturated_voxels& saturated) {
    if (frame_.scene.map != nullptr) walk_outer(sensor, scan, masks);
    frame_.pyramid.build(frame_.ends.rays().width(), frame_.ends.rays().height(), max_z,
                         [&](int v) { return frame_.ends.z(v); });
    frame_.list_nodes(sensor, bounds.first, bounds.second);
    const bool on_face = frame_.is_on_face(sensor);

    const auto end = [&](int u, int v) { return end_of(sensor, scan, u, v); };
    descend_nodes(policy, frame_, sensor, depth_rays{frame_, sensor, end}, on_face, masks, saturated, workers_);
    if (on_face) {
      first_voxels around{sensor};
      for_each_end(sensor, scan, [&](const ray_endpoint& e) { around.add(e); });
      around.mark(masks);
    }
  }

  // -- traversal of every ray, for the few cases that need it

  template <class Use>
  void for_each_end(const depth_sensor& sensor, const depth_scan& scan, Use&& use) const {
    for (int v = 0; v != frame_.ends.rays().height(); ++v)
      for (int u = 0; u != frame_.ends.rays().width(); ++u)
        if (frame_.ends.z(v)[u] > 0.0F) use(end_of(sensor, scan, u, v));
  }
  [[nodiscard]] ray_endpoint end_of(const depth_sensor& sensor, const depth_scan& scan, int u, int v) const {
    const auto [x, y] = frame_.ends.rays().at(u, v);
    return sensor.end(x, y, scan.depth(u, v));
  }
  template <class Policy>
  void walk_all(const Policy& policy, const depth_sensor& sensor, const depth_scan& scan, const se3& T_world_camera,
                const integration_options& options, scan_masks& masks) {
    points_.clear();
    scan.visit([&](const auto& depth) { append_world_points(depth, frame_.ends.rays(), T_world_camera, points_); });
    walker_.mark(policy, sensor.grid, reader_.view(points_), sensor.pose.centre,
                 {.max_range = options.max_range, .mode = ray_mode::every_ray});
    masks.merge(walker_.masks());
  }
  /// Walks the rays outside the map's angular limits, and removes their ends.
  void walk_outer(const depth_sensor& sensor, const depth_scan& scan, scan_masks& masks) {
    for (const auto& [u, v] : frame_.map.outer()) {
      if (!(frame_.ends.z(v)[u] > 0.0F)) continue;
      const ray_endpoint e = end_of(sensor, scan, u, v);
      masks.mark_ray(sensor.grid, sensor.pose.centre, *sensor.key, e.point, e.key);
      frame_.ends.clear(u, v);
    }
  }
  depth_frame frame_;
  point_integrator walker_;
  std::vector<vec3f> points_;
  point_reader reader_;
  std::vector<descent_worker> workers_;
};

}  // namespace orbis::octree::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Finds the voxels that a depth image observes as free and as occupied. Voxels are found by projecting them into the
/// image, not by walking along rays, and are exactly the voxels that the traversal of every ray finds.
#pragma once

#include <cstddef>
#include <limits>
#include <utility>

#include <orbis/core/execution.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/octree/detail/mark/depth/depth_frame.hpp>
#include <orbis/octree/detail/mark/depth/depth_scan.hpp>
#include <orbis/octree/detail/mark/depth/endpoint_rows.hpp>
#include <orbis/octree/detail/mark/depth/first_steps.hpp>
#include <orbis/octree/detail/mark/rays/point_keys.hpp>
#include <orbis/octree/detail/mark/rays/ray_traversal.hpp>
#include <orbis/octree/detail/storage/scan_masks.hpp>
#include <orbis/octree/integration.hpp>

namespace orbis::octree::detail {

/// World points of the pixels of a depth image, row by row, as a point source; NaN for pixels without a point.
struct pixel_points {
  const depth_scan& scan;
  const pixel_rays& rays;
  camera::float_pose pose;
  std::size_t count = static_cast<std::size_t>(rays.width()) * static_cast<std::size_t>(rays.height());

  [[nodiscard]] float3 operator()(std::size_t i) const {
    const auto width = static_cast<std::size_t>(rays.width());
    const auto u = static_cast<int>(i % width), v = static_cast<int>(i / width);
    const float z = scan.depth(u, v);
    const auto [x, y] = rays.at(u, v);
    return camera::world_point(pose, x, y, z > 0.0F ? z : std::numeric_limits<float>::quiet_NaN());
  }
};
inline void load_points(const pixel_points& points, std::size_t begin, std::size_t count, point_batch& batch) {
  for (std::size_t i = 0; i != count; ++i) {
    const float3 p = points(begin + i);
    batch.x[i] = p[0];
    batch.y[i] = p[1];
    batch.z[i] = p[2];
  }
}

/// Marks the voxels of depth images. Reuses its memory between images.
///
/// The descent through the octree starts at a node that contains all rays. Nodes that no ray reaches are skipped, and
/// nodes in which rays certainly cross every voxel are filled; both tests use a min/max pyramid of the ray ends. The
/// remaining voxels are at surfaces and at the border of the view: such a voxel is free if the ray of one of its pixels
/// crosses it. If rounding could change the result, the exact traversal of that ray decides.
class depth_integrator {
 public:
  /// Marks in `masks` the same voxels as integrating the image's world points (see append_world_points) in mode
  /// every_ray, except that free voxels that a miss would not change (see `saturated`) may be missing, and an occupied
  /// voxel may also be marked as free. The summary's voxel counts stay zero. The voxels are the same under every
  /// policy.
  ///
  /// If the rays are too sparse for this method, or too close to the border of the grid, marks only the occupied voxels
  /// and sets `needs_rays`: the caller must mark the rays to the pixels, see `points`.
  ///
  /// `saturated(name, mask)` sets the bits of those voxels of the named brick that a miss would not change; it can be
  /// called from several threads. O(pixels + bricks seen + voxels at surfaces).
  /// @pre depth and camera have the same size
  template <execution_policy Policy>
  integration_summary mark(const Policy& policy, const voxel_grid& grid, const depth_scan& scan,
                           const se3& T_world_camera, const integration_options& options, scan_masks& masks,
                           const saturated_voxels& saturated, bool& needs_rays) {
    needs_rays = false;
    const depth_sensor sensor{grid, T_world_camera, options.max_range};
    masks.clear();
    const end_counts ends = frame_.ends.find_ends(policy, sensor, scan, masks);
    if (sensor.key && ends.leaves) {
      if (!frame_.ends.rays().separable()) frame_.map.fit(frame_.ends.rays());
      frame_.set_scene(sensor);
      const auto bounds = frame_.ray_bounds(sensor, ends.max_z);
      if (bounds && frame_.has_moderate_angles() && frame_.is_dense(ends))
        mark_free(policy, sensor, scan, ends.max_z, *bounds, masks, saturated);
      else
        needs_rays = true;
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

  /// Returns the world points of the last marked image. Valid while `scan` exists, and until the next image.
  [[nodiscard]] pixel_points points(const depth_scan& scan, const se3& T_world_camera) const {
    return {scan, frame_.ends.rays(), camera::float_pose{T_world_camera}};
  }

  [[nodiscard]] std::size_t memory_bytes() const noexcept { return frame_.memory_bytes(); }

 private:
  // -- one frame

  template <class Policy>
  void mark_free(const Policy& policy, const depth_sensor& sensor, const depth_scan& scan, float max_z,
                 const std::pair<voxel_key, voxel_key>& bounds, scan_masks& masks, const saturated_voxels& saturated) {
    if (frame_.scene.map != nullptr) walk_outer(sensor, scan, masks);
    const auto end = [&](int u, int v) { return find_endpoint(sensor, scan, u, v); };
    if (mark_image(policy, frame_, sensor, max_z, bounds, end, masks, saturated)) {
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
        if (frame_.ends.z(v)[u] > 0.0F) use(find_endpoint(sensor, scan, u, v));
  }
  [[nodiscard]] ray_endpoint find_endpoint(const depth_sensor& sensor, const depth_scan& scan, int u, int v) const {
    const auto [x, y] = frame_.ends.rays().at(u, v);
    return sensor.end(x, y, scan.depth(u, v));
  }
  /// Traverses the rays outside the map's angular limits, and removes their ends.
  void walk_outer(const depth_sensor& sensor, const depth_scan& scan, scan_masks& masks) {
    for (const auto& [u, v] : frame_.map.outer()) {
      if (!(frame_.ends.z(v)[u] > 0.0F)) continue;
      const ray_endpoint e = find_endpoint(sensor, scan, u, v);
      mark_ray(masks, sensor.grid, sensor.pose.centre, *sensor.key, e.point, e.key);
      frame_.ends.clear(u, v);
    }
  }

  depth_frame frame_;
};

}  // namespace orbis::octree::detail

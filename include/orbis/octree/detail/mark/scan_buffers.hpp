// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Reusable buffers for the algorithms that find the voxels of a scan.
#pragma once

#include <cassert>
#include <cstddef>
#include <limits>
#include <memory>

#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/octree/detail/mark/depth/depth_integrator.hpp>
#include <orbis/octree/detail/mark/depth/depth_scan.hpp>
#include <orbis/octree/detail/mark/point_integrator.hpp>
#include <orbis/octree/detail/storage/scan_masks.hpp>
#include <orbis/octree/integration.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::octree::detail {

struct scan_buffers {
  point_integrator points;
  std::unique_ptr<depth_integrator> depth;  ///< created by the first image; not compiled if no images are used
  scan_masks masks;

  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return sizeof(scan_buffers) + points.memory_bytes() + (depth ? sizeof(*depth) + depth->memory_bytes() : 0) +
           masks.memory_bytes();
  }
};

/// Marks a depth image in either mode. Returns masks stored in `buffers`; writes the pixel counts to `summary`.
template <class Policy>
const scan_masks& mark_depth(const Policy& policy, scan_buffers& buffers, const voxel_grid& grid,
                             const depth_scan& scan, const se3& T_world_camera, const integration_options& options,
                             integration_summary& summary, const saturated_voxels& saturated = {}) {
  assert(options.max_range >= 0.0);
  scan_masks& masks = buffers.masks;
  masks.clear();
  summary = {};
  if (scan.visit([](const auto& d) { return d.width() == 0 || d.height() == 0; })) return masks;
  if (buffers.depth == nullptr) buffers.depth = std::make_unique<depth_integrator>();
  if (options.mode == ray_mode::every_ray) {
    bool needs_rays = false;
    summary = buffers.depth->mark(policy, grid, scan, T_world_camera, options, masks, saturated, needs_rays);
    if (needs_rays) {
      const float3 origin = camera::float_pose{T_world_camera}.centre;
      buffers.points.mark(policy, grid, buffers.depth->points(scan, T_world_camera), origin, options, saturated);
      masks.merge(buffers.points.masks());
    }
    return masks;
  }
  // The range test applies to the centre of a voxel, not to the points in it.
  integration_options unlimited = options;
  unlimited.max_range = std::numeric_limits<double>::infinity();
  const std::size_t rejected = buffers.depth->mark_ends(policy, grid, scan, T_world_camera, unlimited, masks).rejected;
  const float3 origin = coordinates<float>(T_world_camera.translation());
  summary = buffers.points.mark_centers(policy, grid, masks, origin, options);
  summary.rejected += rejected;
  return buffers.points.masks();
}

}  // namespace orbis::octree::detail

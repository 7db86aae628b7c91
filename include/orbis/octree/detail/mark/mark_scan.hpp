// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions that find the voxels of a scan. scan-inl.hpp defines them; maps of any sensor model call them.
#pragma once

#include <array>

#include <orbis/core/point.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/octree/detail/mark/depth/depth_scan.hpp>
#include <orbis/octree/detail/mark/scan_scratch.hpp>
#include <orbis/octree/detail/storage/scan_masks.hpp>
#include <orbis/octree/integration.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::octree::detail {

/// Marks points in the world frame, seen from `origin`, in either mode. Returns masks stored in `scratch`; writes the
/// counts of points to `summary`. See point_integrator::mark.
template <class Policy>
[[nodiscard]] const scan_masks& mark_points(const Policy& policy, scan_scratch& scratch, const voxel_grid& grid,
                                            const point_view& points, const std::array<float, 3>& origin,
                                            const integration_options& options, integration_summary& summary,
                                            const saturated_voxels& saturated = {});

/// Marks a depth image in either mode, as `mark_points` does. See depth_integrator::mark.
template <class Policy>
[[nodiscard]] const scan_masks& mark_depth(const Policy& policy, scan_scratch& scratch, const voxel_grid& grid,
                                           const depth_scan& scan, const se3& T_world_camera,
                                           const integration_options& options, integration_summary& summary,
                                           const saturated_voxels& saturated = {});

}  // namespace orbis::octree::detail

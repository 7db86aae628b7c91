// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of scan.hpp.
#pragma once

#include <algorithm>
#include <array>

#include <orbis/core/inline.hpp>
#include <orbis/octree/detail/mark/mark_scan.hpp>
#include <orbis/octree/detail/mark/scan_buffers.hpp>
#include <orbis/octree/detail/storage/palette_kernels.hpp>
#include <orbis/octree/detail/storage/scan_masks.hpp>
#include <orbis/octree/scan.hpp>

namespace orbis::octree {

namespace detail {

template <class Policy>
const scan_masks& mark_points(const Policy& policy, scan_scratch& scratch, const voxel_grid& grid,
                              const point_view& points, const std::array<float, 3>& origin,
                              const integration_options& options, integration_summary& summary,
                              const saturated_voxels& saturated) {
  point_integrator& marker = scratch.get<scan_buffers>().points;
  summary = marker.mark(policy, grid, points, origin, options, saturated);
  return marker.masks();
}

template <class Policy>
const scan_masks& mark_depth(const Policy& policy, scan_scratch& scratch, const voxel_grid& grid,
                             const depth_scan& scan, const se3& T_world_camera, const integration_options& options,
                             integration_summary& summary, const saturated_voxels& saturated) {
  return mark_depth(policy, scratch.get<scan_buffers>(), grid, scan, T_world_camera, options, summary, saturated);
}

}  // namespace detail

ORBIS_INLINE void scan::add(const detail::scan_brick& b) {
  part p{.name = b.name, .first = static_cast<std::uint32_t>(words_.size())};
  for (unsigned i = 0; i != 8; ++i) {
    const auto bit = static_cast<std::uint8_t>(1U << i);
    const std::uint64_t free = b.free[i] & ~b.occupied[i];
    if (free == ~std::uint64_t{0}) {
      p.full |= bit;
    } else if (free != 0) {
      p.free |= bit;
      words_.push_back(free);
    }
  }
  for (unsigned i = 0; i != 8; ++i) {
    if (b.occupied[i] == 0) continue;
    p.occupied |= static_cast<std::uint8_t>(1U << i);
    words_.push_back(b.occupied[i]);
  }
  if ((p.free | p.occupied | p.full) != 0) parts_.push_back(p);
}

ORBIS_INLINE void scan_marker::pack(const detail::scan_masks& masks, scan& voxels, integration_summary& summary) {
  const std::vector<detail::scan_brick>& bricks = masks.bricks();
  order_.resize(bricks.size());
  for (std::uint32_t i = 0; i != bricks.size(); ++i) order_[i] = {bricks[i].name, i};
  std::sort(order_.begin(), order_.end());
  voxels.clear();
  for (const auto& [name, i] : order_) {
    for (std::size_t octant = 0; octant != 8; ++octant) {
      const std::uint64_t occupied = bricks[i].occupied[octant];
      summary.occupied += static_cast<std::size_t>(std::popcount(occupied));
      summary.free += static_cast<std::size_t>(std::popcount(bricks[i].free[octant] & ~occupied));
    }
    voxels.add(bricks[i]);
  }
}

template <class Policy>
integration_summary scan_marker::mark_depth(const Policy& policy, const voxel_grid& grid,
                                            const detail::depth_scan& image, const se3& T_world_camera,
                                            const integration_options& options, scan& voxels) {
  integration_summary summary;
  pack(detail::mark_depth(policy, scratch_, grid, image, T_world_camera, options, summary), voxels, summary);
  return summary;
}

template <class Policy>
integration_summary scan_marker::mark_points(const Policy& policy, const voxel_grid& grid,
                                             const detail::point_view& points, const std::array<float, 3>& origin,
                                             const integration_options& options, scan& voxels) {
  integration_summary summary;
  pack(detail::mark_points(policy, scratch_, grid, points, origin, options, summary), voxels, summary);
  return summary;
}

}  // namespace orbis::octree

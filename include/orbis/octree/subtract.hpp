// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Removes an earlier scan from a map.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <ranges>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/octree/depth_points.hpp>
#include <orbis/octree/detail/points/point_integrator.hpp>
#include <orbis/octree/merge.hpp>
#include <orbis/octree/occupancy_octree.hpp>

namespace orbis::octree {

struct subtraction_summary {
  std::size_t restored = 0;   ///< voxels from which the scan's part was taken
  std::size_t forgotten = 0;  ///< of these, voxels of which nothing remained: unknown again
  std::size_t lost = 0;       ///< voxels at a bound, left as they are: their value without the scan cannot be known
};

/// Removes what `map.integrate(points, origin, options)` added; call it with the same arguments.
///
/// The result is an approximation, because clamping loses information. A voxel at a bound stays as it is and counts as
/// lost. A voxel that reached a bound and left it in between comes out too certain by at most what was clamped away.
/// Floating-point values come back to within a few rounding errors (1e-5). A value within 1e-5 of 0 is taken as no
/// observation: the voxel becomes unknown, even if hits and misses of other scans have cancelled out.
/// O(points x voxels per ray).
template <execution_policy Policy, sensor_model Model, point_range Points, point_like Origin>
subtraction_summary subtract(const Policy& policy, occupancy_octree<Model>& map, const Points& points,
                             const Origin& origin, const integration_options& options = {}) {
  using value_type = typename Model::value_type;
  const auto first = std::ranges::begin(points);
  const auto point = [&](std::size_t i) {
    return coordinates<float>(first[static_cast<std::ranges::range_difference_t<const Points>>(i)]);
  };
  detail::point_integrator marker;
  marker.mark(policy, map.grid(), static_cast<std::size_t>(std::ranges::size(points)), point,
              coordinates<float>(origin), options);

  subtraction_summary summary;
  const auto is_nothing = [](value_type v) {
    if constexpr (std::floating_point<value_type>)
      return std::fabs(v) < static_cast<value_type>(1e-5);
    else
      return v == 0;
  };
  std::vector<voxel_key> octants;
  for (const detail::scan_brick& s : marker.masks().bricks()) {
    const voxel_key k = detail::named_key(s.name);
    if (map.store().find(k) == nullptr && map.store().find_large_value(k) == nullptr) continue;
    for (unsigned i = 0; i != 8; ++i)
      if ((s.occupied[i] | s.free[i]) != 0) octants.push_back(child_key(k, i, node_cells(detail::octant_level)));
  }
  map.edit_octants(octants, [&](const voxel_key& k, block<value_type>& voxels) {
    const detail::scan_brick& s = *marker.masks().find(detail::node_name(k, detail::brick_level));
    const std::uint32_t octant = detail::place_in_brick(k) >> 6U;
    for (std::uint64_t rest = (s.occupied[octant] | s.free[octant]) & voxels.known; rest != 0; rest &= rest - 1) {
      const auto place = static_cast<std::size_t>(std::countr_zero(rest));
      const bool hit = (s.occupied[octant] >> place & 1U) != 0;
      value_type& v = voxels.value[place];
      if (v <= Model::clamp_min || v >= Model::clamp_max) {
        ++summary.lost;
        continue;
      }
      v = detail::sum_of<Model>(v, static_cast<value_type>(-(hit ? Model::hit : Model::miss)));
      ++summary.restored;
      if (!is_nothing(v)) continue;
      voxels.known &= ~(std::uint64_t{1} << place);
      ++summary.forgotten;
    }
  });
  return summary;
}
template <sensor_model Model, point_range Points, point_like Origin>
subtraction_summary subtract(occupancy_octree<Model>& map, const Points& points, const Origin& origin,
                             const integration_options& options = {}) {
  return subtract(seq, map, points, origin, options);
}
/// Removes a depth image that `map.integrate(depth, camera, T_world_camera, options)` added. See above.
template <execution_policy Policy, sensor_model Model, camera::depth_source Depth, camera::camera_model Camera>
subtraction_summary subtract(const Policy& policy, occupancy_octree<Model>& map, const Depth& depth,
                             const Camera& camera, const se3& T_world_camera, const integration_options& options = {}) {
  std::vector<vec3f> points;
  append_world_points(depth, camera, T_world_camera, points);
  return subtract(policy, map, points, T_world_camera.translation(), options);
}
template <sensor_model Model, camera::depth_source Depth, camera::camera_model Camera>
subtraction_summary subtract(occupancy_octree<Model>& map, const Depth& depth, const Camera& camera,
                             const se3& T_world_camera, const integration_options& options = {}) {
  return subtract(seq, map, depth, camera, T_world_camera, options);
}

}  // namespace orbis::octree

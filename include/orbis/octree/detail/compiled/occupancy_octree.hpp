// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the library orbis::compiled holds of occupancy_octree.hpp. Its users declare it only; cmake/compiled/octree.cpp
/// defines ORBIS_INSTANTIATE_OCTREE as `template` and makes it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/camera/depth.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/octree/integration.hpp>
#include <orbis/octree/occupancy_octree.hpp>

#ifndef ORBIS_INSTANTIATE_OCTREE
#define ORBIS_INSTANTIATE_OCTREE extern template
#endif

namespace orbis::octree {

#define ORBIS_INSTANTIATE_POINTS(policy, point)                                      \
  ORBIS_INSTANTIATE_OCTREE integration_summary occupancy_octree<>::integrate_points( \
      const policy&, const std::vector<point>&, const std::array<float, 3>&, const integration_options&);
ORBIS_INSTANTIATE_POINTS(sequential_policy, detail::float3)
ORBIS_INSTANTIATE_POINTS(sequential_policy, vec3f)
ORBIS_INSTANTIATE_POINTS(sequential_policy, vec3)
ORBIS_INSTANTIATE_POINTS(parallel_policy, detail::float3)
ORBIS_INSTANTIATE_POINTS(parallel_policy, vec3f)
ORBIS_INSTANTIATE_POINTS(parallel_policy, vec3)
#undef ORBIS_INSTANTIATE_POINTS

#define ORBIS_INSTANTIATE_DEPTH(policy, stored, model)                        \
  ORBIS_INSTANTIATE_OCTREE integration_summary occupancy_octree<>::integrate( \
      const policy&, const camera::depth_view<stored>&, const camera::model&, const se3&, const integration_options&);
ORBIS_INSTANTIATE_DEPTH(sequential_policy, std::uint16_t, pinhole)
ORBIS_INSTANTIATE_DEPTH(sequential_policy, std::uint16_t, any_camera)
ORBIS_INSTANTIATE_DEPTH(sequential_policy, float, pinhole)
ORBIS_INSTANTIATE_DEPTH(sequential_policy, float, any_camera)
ORBIS_INSTANTIATE_DEPTH(parallel_policy, std::uint16_t, pinhole)
ORBIS_INSTANTIATE_DEPTH(parallel_policy, std::uint16_t, any_camera)
ORBIS_INSTANTIATE_DEPTH(parallel_policy, float, pinhole)
ORBIS_INSTANTIATE_DEPTH(parallel_policy, float, any_camera)
#undef ORBIS_INSTANTIATE_DEPTH

}  // namespace orbis::octree

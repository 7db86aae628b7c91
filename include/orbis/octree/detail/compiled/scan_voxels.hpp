// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the library orbis::compiled holds of scan_voxels.hpp. Its users declare it only;
/// cmake/compiled/octree_scans.cpp defines ORBIS_INSTANTIATE_OCTREE as `template` and makes it.
#pragma once

#include <cstdint>

#include <orbis/camera/any.hpp>
#include <orbis/camera/depth.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/octree/integration.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/scan_voxels.hpp>

#ifndef ORBIS_INSTANTIATE_OCTREE
#define ORBIS_INSTANTIATE_OCTREE extern template
#endif

namespace orbis::octree {

#define ORBIS_INSTANTIATE_MARK(policy, stored, model)                                                        \
  ORBIS_INSTANTIATE_OCTREE integration_summary scan_marker::mark(                                            \
      const policy&, const voxel_grid&, const camera::depth_view<stored>&, const camera::model&, const se3&, \
      const integration_options&, scan_voxels&);
ORBIS_INSTANTIATE_MARK(sequential_policy, std::uint16_t, pinhole)
ORBIS_INSTANTIATE_MARK(sequential_policy, std::uint16_t, any_camera)
ORBIS_INSTANTIATE_MARK(sequential_policy, float, pinhole)
ORBIS_INSTANTIATE_MARK(parallel_policy, std::uint16_t, pinhole)
ORBIS_INSTANTIATE_MARK(parallel_policy, std::uint16_t, any_camera)
ORBIS_INSTANTIATE_MARK(parallel_policy, float, pinhole)
#undef ORBIS_INSTANTIATE_MARK

}  // namespace orbis::octree

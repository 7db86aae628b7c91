// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstdint>

#include <orbis/camera/any.hpp>
#include <orbis/camera/depth.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/octree/scan_history-inl.hpp>
#include <orbis/octree/scan_voxels-inl.hpp>

namespace orbis::octree {

using options = integration_options;

template class scan_history<>;
template integration_summary scan_marker::mark_points(const parallel_policy&, const voxel_grid&,
                                                      const detail::point_view&, const std::array<float, 3>&,
                                                      const options&, scan_voxels&);
#define ORBIS_INSTANTIATE_DEPTH(stored, model)                                                                  \
  template integration_summary scan_marker::mark_depth(const parallel_policy&, const voxel_grid&,               \
                                                       const camera::depth_view<stored>&, const camera::model&, \
                                                       const se3&, const options&, scan_voxels&)
ORBIS_INSTANTIATE_DEPTH(std::uint16_t, pinhole);
ORBIS_INSTANTIATE_DEPTH(std::uint16_t, any_camera);
ORBIS_INSTANTIATE_DEPTH(float, pinhole);
ORBIS_INSTANTIATE_DEPTH(float, any_camera);

}  // namespace orbis::octree

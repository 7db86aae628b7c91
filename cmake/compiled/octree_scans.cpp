// SPDX-License-Identifier: BSD-3-Clause
#include <array>

#include <orbis/octree/scan-inl.hpp>
#include <orbis/octree/scan_history-inl.hpp>

namespace orbis::octree {

using options = integration_options;

namespace detail {

template const scan_masks& mark_points(const parallel_policy&, scan_scratch&, const voxel_grid&, const point_view&,
                                       const std::array<float, 3>&, const options&, integration_summary&,
                                       const saturated_voxels&);
template const scan_masks& mark_depth(const parallel_policy&, scan_scratch&, const voxel_grid&, const depth_scan&,
                                      const se3&, const options&, integration_summary&, const saturated_voxels&);

}  // namespace detail

template class scan_history<>;
template integration_summary scan_marker::mark_points(const parallel_policy&, const voxel_grid&,
                                                      const detail::point_view&, const std::array<float, 3>&,
                                                      const options&, scan&);
template integration_summary scan_marker::mark_depth(const parallel_policy&, const voxel_grid&,
                                                     const detail::depth_scan&, const se3&, const options&, scan&);

}  // namespace orbis::octree

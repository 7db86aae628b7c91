// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of voxel_grid.hpp.
#pragma once

#include <orbis/cloud/detail/voxels/fold_voxels.hpp>
#include <orbis/cloud/voxel_grid.hpp>

namespace orbis::cloud::detail {

template <execution_policy Policy, std::floating_point S>
point_cloud find_centroids(const Policy& policy, const basic_point_view<S>& points, std::span<const rgb8> colors,
                           double size) {
  point_cloud out;
  if (colors.empty())
    fold_voxels(policy, points, size, centroid_fold<false>{colors, out});
  else
    fold_voxels(policy, points, size, centroid_fold<true>{colors, out});
  return out;
}

}  // namespace orbis::cloud::detail

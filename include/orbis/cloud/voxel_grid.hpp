// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Downsampling to one point per occupied voxel.
#pragma once

#include <cassert>
#include <concepts>
#include <ranges>
#include <span>
#include <type_traits>

#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/point_cloud.hpp>

namespace orbis::cloud {

struct voxel_grid_options {
  double size = 0.01;  ///< edge length of a voxel, metres; > 0
};

namespace detail {

/// Scalar type for computing cells: float for float coordinates, otherwise double.
template <point_range Points>
using voxel_scalar =
    std::conditional_t<std::is_same_v<point_scalar_t<std::ranges::range_value_t<Points>>, float>, float, double>;

/// `voxel_grid` on a type-erased cloud.
template <execution_policy Policy, std::floating_point S>
[[nodiscard]] point_cloud find_centroids(const Policy& policy, const basic_point_view<S>& points,
                                         std::span<const rgb8> colors, double size);

}  // namespace detail

/// Returns one point for each occupied voxel, in the order in which the voxels first occur: the centroid of its points,
/// with the mean of their colours if `colors` is not empty. The result is the same for every policy. Skips non-finite
/// points and points more than 2^31 voxels from the origin. O(n). Temporary memory: 25 MB, plus about 20 bytes per
/// point (25 with colours) if there are several threads or more than 2^17 points.
///
/// Coordinates are summed in double in the order of the points. If many voxels are occupied, the points are first
/// partitioned so that the voxels of each part fit into the cache.
/// @pre size > 0, fewer than 2^32 - 1 points; colors is empty or as long as points
template <execution_policy Policy, point_range Points>
[[nodiscard]] point_cloud voxel_grid(const Policy& policy, const Points& points, std::span<const rgb8> colors,
                                     const voxel_grid_options& options = {}) {
  assert(colors.empty() || colors.size() == std::ranges::size(points));
  return detail::find_centroids(detail::as_parallel(policy),
                                detail::basic_viewed_points<detail::voxel_scalar<Points>>{points}.view(), colors,
                                options.size);
}

/// Returns one point for each occupied voxel of a cloud without colours.
template <execution_policy Policy, point_range Points>
[[nodiscard]] point_cloud voxel_grid(const Policy& policy, const Points& points,
                                     const voxel_grid_options& options = {}) {
  return voxel_grid(policy, points, std::span<const rgb8>{}, options);
}
template <point_range Points>
[[nodiscard]] point_cloud voxel_grid(const Points& points, const voxel_grid_options& options = {}) {
  return voxel_grid(seq, points, std::span<const rgb8>{}, options);
}
/// Returns one point, with its colour, for each occupied voxel of a `point_cloud`.
template <std::same_as<point_cloud> Cloud>
[[nodiscard]] point_cloud voxel_grid(const Cloud& cloud, const voxel_grid_options& options = {}) {
  return voxel_grid(seq, cloud.points, cloud.colors, options);
}

}  // namespace orbis::cloud

#ifndef ORBIS_COMPILED
#include <orbis/cloud/voxel_grid-inl.hpp>
#endif

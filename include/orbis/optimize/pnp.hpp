// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Perspective-n-point: the camera pose from known points and their pixels, many of which may be mismatched.
///
/// Sources: M. Fischler, R. Bolles, CACM 24 (1981) for P3P in RANSAC; see `ransac.hpp` for the components of RANSAC.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/minimal/pnp_matches.hpp>
#include <orbis/optimize/ransac.hpp>

namespace orbis::optimize {

struct pnp_options {
  double threshold = 3.0;  ///< maximum reprojection error of an inlier, pixels
  double confidence = 0.9999;
  std::size_t min_iterations = 10;
  std::size_t max_iterations = 10000;
  std::size_t min_inliers = 6;  ///< minimum number of inliers for success
  std::uint64_t seed = 1;
};

struct pose_estimate {
  se3 T_world_camera;
  std::vector<std::uint32_t> inliers;  ///< indices of all matches within the threshold for this pose, ascending
  double rmse = 0.0;                   ///< root mean square reprojection error of the inliers, pixels
  std::size_t iterations = 0;
};

/// Reusable memory; not for concurrent calls. Once it is large enough, a call allocates only the inliers of the result.
struct pnp_workspace {
  detail::pnp_matches matches;
  ransac_workspace ransac;
  std::vector<std::uint32_t> part;
};

/// Estimates the pose at which most points `points_world[i]` (metres) project to `pixels[i]`: P3P in RANSAC with a
/// sequential test of the models; each new best pose is refined on its inliers. Non-finite matches, and pixels that the
/// camera cannot unproject, are outliers. Deterministic for a given `options.seed`. O(matches) per completely scored
/// sample. Errors: `invalid_argument` for spans of different lengths or options out of range; `no_data` for fewer than
/// three matches; `degenerate` if fewer than three are usable, all points are collinear or coincide, or no pose has
/// `min_inliers` inliers. The message gives the reason. The library orbis::compiled contains it for `pinhole`,
/// `radial_tangential` and `any_camera`; for others include pnp-inl.hpp.
template <camera::camera_model Camera>
[[nodiscard]] result<pose_estimate> estimate_pose(std::span<const vec3> points_world, std::span<const vec2> pixels,
                                                  const Camera& camera, const pnp_options& options,
                                                  pnp_workspace& workspace);

/// Like the overload with a workspace, but with temporary working memory.
template <camera::camera_model Camera>
[[nodiscard]] result<pose_estimate> estimate_pose(std::span<const vec3> points_world, std::span<const vec2> pixels,
                                                  const Camera& camera, const pnp_options& options = {}) {
  pnp_workspace workspace;
  return estimate_pose(points_world, pixels, camera, options, workspace);
}

}  // namespace orbis::optimize

#ifndef ORBIS_COMPILED
#include <orbis/optimize/pnp-inl.hpp>
#endif

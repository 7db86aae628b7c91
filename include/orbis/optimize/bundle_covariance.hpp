// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The uncertainty of the cameras and points of a bundle adjustment: blocks of the inverse of the normal equations.
///
/// Source: B. Triggs, P. McLauchlan, R. Hartley, A. Fitzgibbon, "Bundle adjustment - a modern synthesis", Vision
/// Algorithms 2000.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/bundle_problem.hpp>
#include <orbis/optimize/detail/bundle/covariance_computation.hpp>
#include <orbis/optimize/robust_loss.hpp>
#include <orbis/optimize/solver_policies.hpp>

namespace orbis::optimize {

enum class covariance_status {
  done,
  nothing_to_do,       ///< no usable observation, or nothing that may move
  missing_pose,        ///< observation `where` names a pose that does not exist
  missing_point,       ///< observation `where` names a point that does not exist
  undetermined_camera  ///< camera `where` is not determined: by its observations, or because nothing holds the whole
};

/// The status in words.
[[nodiscard]] inline std::string describe(covariance_status status, std::size_t where) {
  switch (status) {
    case covariance_status::done: return "done";
    case covariance_status::nothing_to_do: return "nothing to do";
    case covariance_status::missing_pose:
      return "observation " + std::to_string(where) + " names a pose that there is not";
    case covariance_status::missing_point:
      return "observation " + std::to_string(where) + " names a point that there is not";
    case covariance_status::undetermined_camera:
      return "camera " + std::to_string(where) + " is not determined by the observations";
  }
  return "unknown";
}

/// Covariances are with respect to what is fixed. The fixed cameras and points must determine position, rotation and,
/// without depth, the scale of the whole; `hold` can fix the first camera for that.
struct covariance_options {
  std::span<const std::uint8_t> fixed_poses{};   ///< empty, or one entry per camera: nonzero is known exactly
  std::span<const std::uint8_t> fixed_points{};  ///< empty, or one entry per point: nonzero is known exactly
  std::span<const std::uint8_t> ignored{};       ///< empty, or one entry per observation: nonzero leaves it out
  bundle_gauge hold = bundle_gauge::damped;      ///< `damped`: only what is fixed
};

/// Covariances of the cameras, of a step on their manifold (for a pose: translation in metres, then rotation in
/// radians, both in the camera frame), and of the points in the world frame. Zero for what is fixed. NaN where there is
/// none: without observations, or for a point with too few to determine it.
template <bundle_residual R>
struct bundle_covariance {
  covariance_status status = covariance_status::nothing_to_do;
  std::size_t where = 0;  ///< the observation or camera that a failure is about
  std::vector<matrix<R::camera_manifold::dimension, R::camera_manifold::dimension>> cameras;
  std::vector<mat3> points;
};

/// Whether there are no covariances.
[[nodiscard]] inline bool is_failure(covariance_status status) noexcept { return status != covariance_status::done; }

/// The covariances at these estimates, which should be a minimum: blocks of the inverse of J^T W J, with the weights of
/// the loss there and `information` taken as 1 / sigma^2. Points that their observations do not determine (in one view
/// without depth, for example) take no part.
///
/// O(observations + sum over the points of the square of the number of cameras that see them), and for each camera as
/// many solutions of the reduced system as it has unknowns. The same bits for every execution policy.
/// @pre the options' spans are empty or of matching length
template <execution_policy Policy, camera_frame_residual R, robust_loss Loss = trivial,
          reduced_solver Reduced = automatic_reduced_solver>
[[nodiscard]] bundle_covariance<R> covariance_of(const Policy& policy, const R& residual,
                                                 std::span<const typename R::camera_state> cameras,
                                                 std::span<const vec3> points,
                                                 std::span<const typename R::observation> observations,
                                                 const covariance_options& options = {}, const Loss& loss = {},
                                                 const Reduced& reduced = {}) {
  detail::covariance_computation<R, Loss, Reduced, covariance_options, bundle_covariance<R>> computation{residual, loss,
                                                                                                         reduced};
  return computation.run(policy, cameras, points, observations, options);
}

}  // namespace orbis::optimize

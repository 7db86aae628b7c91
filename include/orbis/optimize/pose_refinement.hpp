// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Pose-only refinement: estimates the camera pose that minimises the reprojection errors of known points.
///
/// Levenberg-Marquardt on SE(3) in rounds. After each round every observation is classified as an inlier or an outlier
/// by its chi-squared error at the current pose; the last round omits the robust loss. Eight observations are processed
/// at a time. Needs about 80 kB of stack and never allocates memory.
///
/// Source for the rounds: R. Mur-Artal, J. D. Tardos, "ORB-SLAM2", T-RO 33 (2017).
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <orbis/camera/model.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/robust_loss.hpp>

namespace orbis::optimize {

enum class refinement_status {
  converged,             ///< the last round ended because no further step improved the pose
  iteration_limit,       ///< the last round reached its maximum number of iterations
  too_few_observations,  ///< fewer than three usable observations, initially or after gating
  degenerate,            ///< the observations do not determine the pose (for example collinear points)
  invalid_start          ///< the initial pose is not finite
};

[[nodiscard]] constexpr std::string_view to_string(refinement_status status) noexcept {
  switch (status) {
    case refinement_status::converged: return "converged";
    case refinement_status::iteration_limit: return "iteration limit";
    case refinement_status::too_few_observations: return "too few observations";
    case refinement_status::degenerate: return "degenerate";
    case refinement_status::invalid_start: return "initial pose is not finite";
  }
  return "unknown";
}

struct pose_refinement_options {
  int rounds = 4;
  int iterations = 10;  ///< maximum number of iterations per round
  /// Maximum chi-squared error of an inlier without depth, and with depth.
  double gate_mono = chi_squared_gate(2), gate_depth = chi_squared_gate(3);
};

struct pose_refinement {
  refinement_status status = refinement_status::too_few_observations;
  se3 T_world_camera;  ///< the initial pose if `!ok()`
  std::size_t inliers = 0;
  double cost = 0.0;   ///< half the sum of the chi-squared errors of the inliers
  int iterations = 0;  ///< accepted steps in all rounds
  [[nodiscard]] bool ok() const noexcept {
    return status == refinement_status::converged || status == refinement_status::iteration_limit;
  }
};

namespace detail {

template <class Camera>
[[nodiscard]] pose_refinement refine_pose(std::span<const pose_observation> observations, const Camera& camera,
                                          double bf, const se3& T_world_camera, std::span<std::uint8_t> outliers,
                                          const pose_refinement_options& options, const huber& loss);

}  // namespace detail

/// Refines `T_world_camera` from an initial pose, and sets `outliers[i]` to 1 if observation `i` is an outlier,
/// otherwise to 0. Observations that are not finite, or have no information or no projection, are outliers.
/// O(observations) per step. Every instruction set gives the same bits. The library's camera models are faster than
/// user-defined ones. The library orbis::compiled contains this function for these models; for others include
/// pose_refinement-inl.hpp.
/// @pre outliers.size() == observations.size()
template <camera::camera_model Camera>
[[nodiscard]] pose_refinement refine_pose(std::span<const pose_observation> observations,
                                          const reprojection<Camera>& model, const se3& T_world_camera,
                                          std::span<std::uint8_t> outliers, const pose_refinement_options& options = {},
                                          const huber& loss = {2.447}) {
  assert(outliers.size() == observations.size());
  return camera::with_model(model.camera, [&](const auto& camera) {
    return detail::refine_pose(observations, camera, model.bf, T_world_camera, outliers, options, loss);
  });
}

}  // namespace orbis::optimize

#ifndef ORBIS_COMPILED
#include <orbis/optimize/pose_refinement-inl.hpp>
#endif

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Pose-only refinement: the camera pose that best explains observations of known points.
///
/// Levenberg-Marquardt on SE(3) in rounds; after each round every observation is judged anew by its
/// chi-squared at the current pose, and the last round goes without the robust loss. Works on the
/// caller's arrays and the stack; never allocates.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>

#include <Eigen/Cholesky>

#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/robust_loss.hpp>

namespace orbis::optimize {

enum class refinement_status {
  converged,             ///< the last round ended because no step improved the pose any further
  iteration_limit,       ///< the last round ended by its number of iterations
  too_few_observations,  ///< fewer than three usable observations, from the start or after the gates
  degenerate,            ///< the observations leave a direction of the pose free (collinear points, say)
  invalid_start          ///< the starting pose is not finite
};

[[nodiscard]] constexpr std::string_view to_string(refinement_status status) noexcept {
  switch (status) {
    case refinement_status::converged: return "converged";
    case refinement_status::iteration_limit: return "iteration limit";
    case refinement_status::too_few_observations: return "too few observations";
    case refinement_status::degenerate: return "degenerate";
    case refinement_status::invalid_start: return "invalid start";
  }
  return "unknown";
}

struct pose_refinement_options {
  int rounds = 4;
  int iterations = 10;        ///< per round
  double gate_mono = 5.991;   ///< chi-squared, 95 %, two degrees of freedom
  double gate_depth = 7.815;  ///< three degrees of freedom
};

struct pose_refinement {
  refinement_status status = refinement_status::too_few_observations;
  se3 T_world_camera;  ///< the starting pose where `!ok()`
  std::size_t inliers = 0;
  double cost = 0.0;   ///< half the sum of chi-squared over the inliers
  int iterations = 0;  ///< accepted steps, over all rounds
  [[nodiscard]] bool ok() const noexcept {
    return status == refinement_status::converged || status == refinement_status::iteration_limit;
  }
};

namespace detail {

struct pose_normal_equations {
  mat6 h = mat6::Zero();
  vec6 g = vec6::Zero();
  double cost = 0.0;  ///< half the robust sum
};

/// Whether the six directions of the pose are determined: the pivots of the equations scaled to a
/// unit diagonal are well above rounding.
[[nodiscard]] inline bool is_determined(const mat6& h) {
  vec6 scale = h.diagonal();
  if (!(scale.minCoeff() > 0.0) || !scale.allFinite()) return false;
  scale = scale.cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<mat6> scaled(mat6(scale.asDiagonal() * h * scale.asDiagonal()));
  return scaled.vectorD().minCoeff() > 1e-11;
}

}  // namespace detail

/// Refines `T_world_camera` and writes for each observation whether it is an outlier (1) or not (0).
/// Observations that are not finite, of no information, or without a projection are outliers.
/// @pre outliers.size() == observations.size()
template <camera::camera_model Camera, robust_loss Loss = huber>
[[nodiscard]] pose_refinement refine_pose(std::span<const pose_observation> observations,
                                          const reprojection<Camera>& model, const se3& T_world_camera,
                                          std::span<std::uint8_t> outliers, const pose_refinement_options& options = {},
                                          const Loss& loss = Loss{2.447}) {
  assert(outliers.size() == observations.size());
  pose_refinement out;
  out.T_world_camera = T_world_camera;
  std::fill(outliers.begin(), outliers.end(), std::uint8_t{1});
  if (!T_world_camera.to_matrix().allFinite()) {
    out.status = refinement_status::invalid_start;
    return out;
  }
  const auto usable = [](const pose_observation& o) {
    return o.point.allFinite() && o.pixel.allFinite() && !std::isinf(o.right) && o.information > 0.0 &&
           std::isfinite(o.information);
  };
  std::size_t active = 0;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    outliers[i] = usable(observations[i]) ? 0 : 1;
    active += outliers[i] == 0;
  }

  se3 T_camera_world = T_world_camera.inverse();

  // A point behind the camera costs as much as one at the edge of the gate, so that a step cannot
  // gain by losing points.
  const auto linearize = [&](const se3& pose, const auto& rho) {
    detail::pose_normal_equations e;
    const mat3 rotation = pose.rotation_matrix();
    for (std::size_t i = 0; i < observations.size(); ++i) {
      if (outliers[i] != 0) continue;
      const pose_observation& o = observations[i];
      const vec3 p = rotation * o.point + pose.translation();
      mat3 j;
      const auto r = model.residual(p, o, j);
      if (!r) {
        e.cost += 0.5 * rho.cost(options.gate_depth);
        continue;
      }
      const double chi2 = o.information * r->squaredNorm();
      e.cost += 0.5 * rho.cost(chi2);
      const double w = rho.weight(chi2) * o.information;
      // Left perturbation, exp(xi) * T: the point moves by rho + phi x p.
      matrix<3, 6> full;
      full.leftCols<3>() = j;
      for (int row = 0; row < 3; ++row) full.row(row).tail<3>() = p.cross(vec3(j.row(row).transpose())).transpose();
      e.h.noalias() += w * full.transpose() * full;
      e.g.noalias() += w * full.transpose() * *r;
    }
    return e;
  };
  const auto cost_at = [&](const se3& pose, const auto& rho) {
    double cost = 0.0;
    const mat3 rotation = pose.rotation_matrix();
    for (std::size_t i = 0; i < observations.size(); ++i) {
      if (outliers[i] != 0) continue;
      const pose_observation& o = observations[i];
      const auto r = model.residual(rotation * o.point + pose.translation(), o);
      cost += 0.5 * rho.cost(r ? o.information * r->squaredNorm() : options.gate_depth);
    }
    return cost;
  };
  const auto give_up = [&](refinement_status status) {
    out.status = status;
    out.T_world_camera = T_world_camera;
    std::fill(outliers.begin(), outliers.end(), std::uint8_t{1});
    out.inliers = 0;
    out.cost = 0.0;
    return out;
  };

  const auto run_round = [&](const auto& rho) {
    double lambda = 1e-6;
    auto equations = linearize(T_camera_world, rho);
    for (int k = 0; k < options.iterations; ++k) {
      if (!detail::is_determined(equations.h)) return refinement_status::degenerate;
      bool accepted = false;
      double gain = 0.0;
      for (int attempt = 0; attempt < 8 && !accepted; ++attempt, lambda *= accepted ? 1.0 : 10.0) {
        mat6 damped = equations.h;
        damped.diagonal() *= 1.0 + lambda;
        const vec6 step = damped.ldlt().solve(vec6(-equations.g));
        if (!step.allFinite()) continue;
        if (step.squaredNorm() < 1e-20) return refinement_status::converged;
        const se3 candidate = se3::exp(step) * T_camera_world;
        const double cost = cost_at(candidate, rho);
        if (!(cost < equations.cost)) continue;
        accepted = true;
        gain = equations.cost - cost;
        T_camera_world = candidate;
      }
      if (!accepted) return refinement_status::converged;
      ++out.iterations;
      lambda = std::max(1e-9, lambda * 0.1);
      if (gain <= 1e-9 * equations.cost) return refinement_status::converged;
      equations = linearize(T_camera_world, rho);
    }
    return refinement_status::iteration_limit;
  };

  for (int round = 0; round < options.rounds; ++round) {
    if (active < 3) return give_up(refinement_status::too_few_observations);
    const bool last = round + 1 == options.rounds;
    out.status = last ? run_round(trivial{}) : run_round(loss);
    if (out.status == refinement_status::degenerate) return give_up(out.status);
    active = 0;
    out.cost = 0.0;
    for (std::size_t i = 0; i < observations.size(); ++i) {
      const pose_observation& o = observations[i];
      outliers[i] = 1;
      if (!usable(o)) continue;
      const auto r = model.residual(T_camera_world * o.point, o);
      if (!r) continue;
      const double chi2 = o.information * r->squaredNorm();
      if (!(chi2 <= (o.has_depth() ? options.gate_depth : options.gate_mono))) continue;
      outliers[i] = 0;
      out.cost += 0.5 * chi2;
      ++active;
    }
  }
  if (active < 3) return give_up(refinement_status::too_few_observations);
  out.inliers = active;
  out.T_world_camera = T_camera_world.inverse();
  return out;
}

}  // namespace orbis::optimize

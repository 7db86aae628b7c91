// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions of motion_refinement.hpp that no camera enters: inline, or, with ORBIS_COMPILED, compiled once, by
/// cmake/compiled/slam_motion.cpp.
#pragma once

#include <array>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <orbis/core/compiled_once.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/small_cholesky.hpp>
#include <orbis/core/types.hpp>
#include <orbis/slam/detail/shutter/motion_refinement.hpp>

namespace orbis::slam::detail {

ORBIS_COMPILED_ONCE vec6 twist_prior::expected(const se3& T_camera_world) const {
  if (!T_world_before) return zeros<vec6>();
  const vec6 mean = (T_camera_world * *T_world_before).inverse().log() / interval;
  return mean + trend * (mean - twist_before);
}

ORBIS_COMPILED_ONCE void pose_quadratic::hold_twist() {
  for (int i = 0; i != 12; ++i)
    for (int k = 6; k != 12; ++k) h(i, k) = h(k, i) = 0.0;
  for (int i = 6; i != 12; ++i) g[i] = 0.0;
}

ORBIS_COMPILED_ONCE void add_terms(moving_pose_equations& e, const std::array<mat6, 3>& h, const std::array<vec6, 2>& g,
                                   const se3& T_camera_world, const vec6& twist, const twist_prior& prior,
                                   const refinement_terms& terms) {
  set_parts(e, h, g);
  if (terms.other != nullptr) {
    const pose_quadratic& q = *terms.other;
    const matrix<12, 1> step = stacked((T_camera_world * q.at.T_world_camera).log(), twist - q.at.twist);
    const matrix<12, 1> slope = q.h * step;
    e.h += q.h;
    e.g += q.g + slope;
    e.cost += q.cost + dot(step, q.g + 0.5 * slope);
  }
  if (!terms.moves) return;

  const vec6 error = twist - prior.expected(T_camera_world);
  const double by_pose = prior.T_world_before ? (1.0 + prior.trend) / prior.interval : 0.0;  // to first order
  for (int i = 0; i != 6; ++i) {
    const double deviation = i < 3 ? prior.translation_deviation : prior.rotation_deviation;
    const double weight = 1.0 / (deviation * deviation);
    e.cost += 0.5 * weight * error[i] * error[i];
    e.h(i, i) += weight * by_pose * by_pose;
    e.h(i, 6 + i) += weight * by_pose;
    e.h(6 + i, i) += weight * by_pose;
    e.h(6 + i, 6 + i) += weight;
    e.g[i] += weight * by_pose * error[i];
    e.g[6 + i] += weight * error[i];
  }
}

ORBIS_COMPILED_ONCE matrix<12, 1> newton_step(const moving_pose_equations& e, bool moves) {
  if (moves) return solve_semidefinite(e.h, matrix<12>(-e.g)).value_or(zeros<matrix<12>>());
  const auto pose = solve_semidefinite(block<6, 6>(e.h, 0, 0), vec6(-head<6>(e.g)));
  return stacked(pose.value_or(zeros<vec6>()), zeros<vec6>());
}

/// The squares of the deviations, times the square of `factor`, on the diagonal.
[[nodiscard]] inline mat6 variances_of(const twist_prior& prior, double factor) {
  const double t = factor * prior.translation_deviation, r = factor * prior.rotation_deviation;
  return diagonal_matrix(stacked(filled<vec3>(t * t), filled<vec3>(r * r)));
}

ORBIS_COMPILED_ONCE void early_depth_twist::determine(const std::array<mat6, 3>& h, const twist_prior& prior) {
  pose_covariance_ = inverse(h[0]);
  if (!prior.T_world_before) return;
  // The prior ties the twist to both poses, of which the former one is not exact either.
  const double by_pose = (1.0 + prior.trend) / prior.interval;
  const mat6 tie =
      inverse(variances_of(prior, 1.0) + by_pose * by_pose * former_covariance_);
  const mat6 mixed = h[1] + by_pose * tie;
  const mat6 of_twist = h[2] + tie - transposed(mixed) * inverse(h[0] + by_pose * by_pose * tie) * mixed;
  // From one frame to the next a twist changes by twice the deviation of the prior, which is that from the mean.
  const mat6 change = variances_of(prior, 2.0);
  gain_ = change * inverse(change + inverse(of_twist));
}

ORBIS_COMPILED_ONCE vec6 early_depth_twist::between(const twist_prior& prior, const vec6& refined) const {
  if (!prior.T_world_before || !all_finite(gain_)) return refined;
  return prior.twist_before + gain_ * (refined - prior.twist_before);
}

}  // namespace orbis::slam::detail

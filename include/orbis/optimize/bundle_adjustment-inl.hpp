// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of bundle_adjustment.hpp.
#pragma once

#include <utility>

#include <orbis/optimize/bundle_adjustment.hpp>
#include <orbis/optimize/detail/bundle/bundle_solver.hpp>
#include <orbis/optimize/reprojection-inl.hpp>

namespace orbis::optimize {

template <bundle_residual Residual, robust_loss Loss, damping_policy Damping>
bundle_adjuster<Residual, Loss, Damping>::bundle_adjuster(Residual residual, Loss loss, Damping damping,
                                                          const reduced_solver_options& reduced)
    : solver_{detail::bundle_solver<Residual, Loss, Damping>{std::move(residual), std::move(loss), std::move(damping),
                                                             reduced}} {}

template <bundle_residual Residual, robust_loss Loss, damping_policy Damping>
double bundle_adjuster<Residual, Loss, Damping>::chi2(const camera_state& camera, const vec3& point,
                                                      const observation& o) const {
  return solver_->chi2(camera, point, o);
}

template <bundle_residual Residual, robust_loss Loss, damping_policy Damping>
void bundle_adjuster<Residual, Loss, Damping>::chi2(std::span<const camera_state> cameras, std::span<const vec3> points,
                                                    std::span<const observation> observations, std::span<double> out) {
  solver_->chi2(cameras, points, observations, out);
}

template <bundle_residual Residual, robust_loss Loss, damping_policy Damping>
template <execution_policy Policy, class Report>
bundle_summary bundle_adjuster<Residual, Loss, Damping>::solve(const Policy& policy, std::span<camera_state> cameras,
                                                               std::span<vec3> points,
                                                               std::span<const observation> observations,
                                                               const bundle_options& options, progress callback,
                                                               Report&& report) {
  return solver_->solve(policy, cameras, points, observations, options, callback, report);
}

template <bundle_residual Residual, robust_loss Loss, damping_policy Damping>
template <execution_policy Policy, class Report>
bundle_summary bundle_adjuster<Residual, Loss, Damping>::solve_again(const Policy& policy,
                                                                     std::span<camera_state> cameras,
                                                                     std::span<vec3> points,
                                                                     const bundle_options& options, progress callback,
                                                                     Report&& report) {
  return solver_->solve_again(policy, cameras, points, options, callback, report);
}

}  // namespace orbis::optimize

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bundle adjustment: estimates the cameras and points that jointly minimise the robust cost of all observations.
///
/// Source: B. Triggs, P. McLauchlan, R. Hartley, A. Fitzgibbon, "Bundle adjustment - a modern
/// synthesis", Vision Algorithms 2000.
#pragma once

#include <concepts>
#include <span>

#include <orbis/core/execution.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/bundle_problem.hpp>
#include <orbis/optimize/detail/boxed.hpp>
#include <orbis/optimize/detail/stage_watch.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/robust_loss.hpp>
#include <orbis/optimize/solver_policies.hpp>

namespace orbis::optimize {

namespace detail {
/// The initial damping of bundle adjustment, which is stronger than that of pose graphs.
template <class Damping>
[[nodiscard]] Damping default_bundle_damping() {
  Damping damping{};
  if constexpr (std::same_as<Damping, levenberg_marquardt>) damping.initial = 1e-4;
  return damping;
}
template <class Residual, class Loss, class Damping>
class bundle_solver;
}  // namespace detail

/// Bundle adjustment with a residual, a robust loss and a damping policy as template parameters:
///
/// @code
///   bundle_adjuster ba{reprojection{camera}, huber{2.45}};
///   auto summary = ba.solve(par, poses, points, observations, {.max_iterations = 10});
/// @endcode
///
/// The points are eliminated by the Schur complement. One step takes O(observations + sum over the points of the square
/// of the number of cameras that observe them), plus the solution of the reduced system of the cameras. Memory is
/// reused: a second problem of the same size allocates nothing (with `orbis::seq`, unless its reduced system is
/// factorised as a sparse matrix). Every policy, number of threads and instruction set gives the same bits. Not
/// thread-safe.
///
/// The library orbis::compiled contains it for `reprojection` with `camera::pinhole` and `camera::any_camera`, with the
/// default loss and policies and without a report; for other arguments include bundle_adjustment-inl.hpp.
template <bundle_residual Residual, robust_loss Loss = huber, damping_policy Damping = levenberg_marquardt>
class bundle_adjuster {
 public:
  using camera_state = typename Residual::camera_state;
  using observation = typename Residual::observation;

  explicit bundle_adjuster(Residual residual, Loss loss = Loss{},
                           Damping damping = detail::default_bundle_damping<Damping>(),
                           const reduced_solver_options& reduced = {});

  /// Returns the chi-squared error of an observation: `information` times the squared norm of its residual; infinite if
  /// there is no projection.
  [[nodiscard]] double chi2(const camera_state& camera, const vec3& point, const observation& o) const;

  /// Computes the chi-squared errors of all observations: `out[k]` is the error of `observations[k]`.
  /// @pre the observations' indices are in range; `out` has room for all
  void chi2(std::span<const camera_state> cameras, std::span<const vec3> points,
            std::span<const observation> observations, std::span<double> out);

  /// Minimises the robust cost over `cameras` and `points`. The final cost is never higher than the initial one, and
  /// the estimates are unchanged if the status is a failure (`is_failure`). Observations that are not finite, or have
  /// no projection at the start, are excluded; the summary contains their number. `callback(iteration, max_iterations)`
  /// is called before each step and returns false to stop. `report(summary)` is called before the first step and after
  /// each one.
  /// @pre the options' spans are empty or of matching length
  template <execution_policy Policy, class Report = detail::no_report>
  bundle_summary solve(const Policy& policy, std::span<camera_state> cameras, std::span<vec3> points,
                       std::span<const observation> observations, const bundle_options& options = {},
                       progress callback = {}, Report&& report = {});

  /// Solves again with the observations of the last call to `solve`, starting at the given `cameras` and `points`. The
  /// options may ignore a different set of observations, and fix different poses or points. Ordering and structure
  /// are reused unless the fixed poses change.
  /// @pre the same number of cameras and points as in that call; the observations are unchanged and in the same memory
  template <execution_policy Policy, class Report = detail::no_report>
  bundle_summary solve_again(const Policy& policy, std::span<camera_state> cameras, std::span<vec3> points,
                             const bundle_options& options = {}, progress callback = {}, Report&& report = {});

 private:
  detail::boxed<detail::bundle_solver<Residual, Loss, Damping>> solver_;
};

}  // namespace orbis::optimize

#ifndef ORBIS_COMPILED
#include <orbis/optimize/bundle_adjustment-inl.hpp>
#endif

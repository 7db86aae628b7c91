// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bundle adjustment: the cameras and points that together best explain all observations.
///
/// Source: B. Triggs, P. McLauchlan, R. Hartley, A. Fitzgibbon, "Bundle adjustment - a modern
/// synthesis", Vision Algorithms 2000.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/optimize/bundle_problem.hpp>
#include <orbis/optimize/detail/bundle/bundle_equations.hpp>
#include <orbis/optimize/detail/stage_watch.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/robust_loss.hpp>
#include <orbis/optimize/solver_policies.hpp>

namespace orbis::optimize {

namespace detail {
/// Bundle adjustment starts with more damping than pose graphs.
template <class Damping>
[[nodiscard]] Damping default_bundle_damping() {
  Damping damping{};
  if constexpr (std::same_as<Damping, levenberg_marquardt>) damping.initial = 1e-4;
  return damping;
}
}  // namespace detail

/// A solver made of a residual, a robust loss, a damping policy and a solver of the reduced system, each a type:
///
/// @code
///   bundle_adjuster ba{reprojection{camera}, huber{2.45}};
///   auto summary = ba.solve(par, poses, points, observations, {.max_iterations = 10});
/// @endcode
///
/// The points are eliminated by the Schur complement. One step costs O(observations + sum over the points of the square
/// of the number of cameras that see them), and the solution of the reduced system of the cameras. Keeps its memory: a
/// second problem of the same size allocates nothing (with `orbis::seq` and a dense or iterative reduced solver). Every
/// policy, number of threads and instruction set gives the same bits. Not thread-safe.
template <bundle_residual Residual, robust_loss Loss = huber, general_damping_policy Damping = levenberg_marquardt,
          reduced_solver ReducedSolver = automatic_reduced_solver>
class bundle_adjuster {
 public:
  using camera_state = typename Residual::camera_state;
  using observation = typename Residual::observation;

  explicit bundle_adjuster(Residual residual, Loss loss = Loss{},
                           Damping damping = detail::default_bundle_damping<Damping>(),
                           ReducedSolver reduced = ReducedSolver{})
      : equations_{std::move(residual), std::move(loss), reduced}, damping_{std::move(damping)} {}

  /// The chi-squared error of an observation: `information` times the squared norm of its residual; infinite without a
  /// projection.
  [[nodiscard]] double chi2(const camera_state& camera, const vec3& point, const observation& o) const {
    return chi2_in(equations_.residual().prepare(camera), point, o);
  }

  /// The chi-squared errors of all observations: `out[k]` of `observations[k]`.
  /// @pre the observations' indices are in range; `out` has room for all
  void chi2(std::span<const camera_state> cameras, std::span<const vec3> points,
            std::span<const observation> observations, std::span<double> out) {
    assert(out.size() >= observations.size());
    chi2_views_.resize(cameras.size());
    for (std::size_t c = 0; c != cameras.size(); ++c) chi2_views_[c] = equations_.residual().prepare(cameras[c]);
    for (std::size_t k = 0; k != observations.size(); ++k)
      out[k] = chi2_in(chi2_views_[observations[k].pose], points[observations[k].point], observations[k]);
  }

  /// Moves `cameras` and `points` so that the robust cost falls. They are never left with a higher cost than they had,
  /// and are unchanged if the status is a failure of the input. Observations that are not finite, or have no projection
  /// at the start, take no part; the summary counts them.
  ///
  /// `callback(iteration, max_iterations)` is asked before each step whether to go on. `report(summary)` is called
  /// before the first step and after each one.
  /// @pre the options' spans are empty or of matching length
  template <execution_policy Policy, class Report = detail::no_report>
  bundle_summary solve(const Policy& policy, std::span<camera_state> cameras, std::span<vec3> points,
                       std::span<const observation> observations, const bundle_options& options = {},
                       progress callback = {}, Report&& report = {}) {
    bundle_summary summary;
    {
      const detail::stage_watch watch{summary.seconds.set_up};
      if (!check(cameras.size(), points.size(), observations, summary)) return summary;
      set_up(cameras.size(), points.size(), observations, options);
    }
    return run(policy, cameras, points, options, callback, report, summary);
  }

  /// Solves for the observations of the last call of `solve` again, from these estimates and with these options; other
  /// observations may be ignored, and other poses or points fixed. Ordering and structure are reused unless other poses
  /// are fixed.
  /// @pre as many cameras and points as in that call, and its observations unchanged and still in the same memory
  template <execution_policy Policy, class Report = detail::no_report>
  bundle_summary solve_again(const Policy& policy, std::span<camera_state> cameras, std::span<vec3> points,
                             const bundle_options& options = {}, progress callback = {}, Report&& report = {}) {
    assert(cameras.size() == equations_.structure().count.size());
    bundle_summary summary;
    if (!std::equal(fixed_.begin(), fixed_.end(), options.fixed_poses.begin(), options.fixed_poses.end())) {
      const detail::stage_watch watch{summary.seconds.set_up};
      set_up(cameras.size(), points.size(), observations_, options);
    }
    return run(policy, cameras, points, options, callback, report, summary);
  }

 private:
  using equations_type = detail::bundle_equations<Residual, Loss, ReducedSolver>;

  /// The equations as the damping policies see them.
  template <class Policy>
  struct problem {
    equations_type& equations;
    const Policy& policy;
    bundle_summary& summary;

    void linearize() {
      const detail::stage_watch watch{summary.seconds.linearize};
      equations.linearize(policy);
      summary.gradient = equations.gradient().size() == 0 ? 0.0 : equations.gradient().cwiseAbs().maxCoeff();
    }
    [[nodiscard]] double cost() const { return equations.cost(); }
    [[nodiscard]] const Eigen::VectorXd& gradient() const { return equations.gradient(); }
    [[nodiscard]] const Eigen::VectorXd& diagonal() const { return equations.diagonal(); }
    [[nodiscard]] double curvature(const Eigen::VectorXd& x) const { return equations.curvature(x); }
    [[nodiscard]] bool factor(const Eigen::VectorXd& damping) {
      {
        const detail::stage_watch watch{summary.seconds.schur};
        if (!equations.eliminate(policy, damping)) return false;
      }
      const detail::stage_watch watch{summary.seconds.factor};
      return equations.factor();
    }
    void newton_step(Eigen::VectorXd& out) {
      {
        const detail::stage_watch watch{summary.seconds.solve};
        equations.solve_cameras(out);
      }
      const detail::stage_watch watch{summary.seconds.back_substitute};
      equations.solve_points(policy, out);
    }
    [[nodiscard]] double try_step(const Eigen::VectorXd& step) {
      const detail::stage_watch watch{summary.seconds.evaluate};
      ++summary.steps_tried;
      return equations.try_step(policy, step);
    }
  };

  [[nodiscard]] double chi2_in(const typename Residual::view& view, const vec3& point, const observation& o) const {
    const auto r = equations_.residual().residual(view, point, o);
    return r ? o.information * squared_norm(*r) : std::numeric_limits<double>::infinity();
  }

  [[nodiscard]] static bool check(std::size_t cameras, std::size_t points, std::span<const observation> observations,
                                  bundle_summary& summary) {
    for (std::size_t k = 0; k != observations.size(); ++k) {
      if (observations[k].pose < cameras && observations[k].point < points) continue;
      summary.status = observations[k].pose < cameras ? bundle_status::missing_point : bundle_status::missing_pose;
      summary.where = k;
      return false;
    }
    return true;
  }

  void set_up(std::size_t cameras, std::size_t points, std::span<const observation> observations,
              const bundle_options& options) {
    assert(options.fixed_poses.empty() || options.fixed_poses.size() == cameras);
    observations_ = observations;
    fixed_.assign(options.fixed_poses.begin(), options.fixed_poses.end());
    equations_.set_structure(cameras, points, observations, options.fixed_poses);
  }

  /// Counts the observations that cannot be used at all.
  void count_unusable(std::span<const std::uint8_t> ignored, bundle_summary& summary) const {
    for (std::size_t k = 0; k != observations_.size(); ++k)
      if ((ignored.empty() || ignored[k] == 0) && !equations_.residual().is_usable(observations_[k]))
        if (summary.left_out++ == 0) summary.first_left_out = k;
  }

  [[nodiscard]] bool has_finite_cameras(std::span<const camera_state> cameras, bundle_summary& summary) const {
    if constexpr (camera_frame_residual<Residual>)
      for (std::size_t c = 0; c != cameras.size(); ++c) {
        if (equations_.structure().count[c] == 0) continue;
        const auto view = equations_.residual().prepare(cameras[c]);
        if (all_finite(view.rotation) && all_finite(view.translation)) continue;
        summary.status = bundle_status::bad_pose;
        summary.where = c;
        return false;
      }
    return true;
  }

  template <class Policy, class Report>
  bundle_summary run(const Policy& policy, std::span<camera_state> cameras, std::span<vec3> points,
                     const bundle_options& options, const progress& callback, Report& report, bundle_summary& summary);

  template <class View, class Report>
  [[nodiscard]] bundle_status iterate(View& view, const bundle_options& options, const progress& callback,
                                      bundle_summary& summary, Report& report) {
    typename Damping::state state;
    const auto limit = static_cast<std::size_t>(std::max(0, options.max_iterations));
    for (std::size_t k = 0; k != limit; ++k) {
      if (!callback(k, limit)) return bundle_status::cancelled;
      if (summary.gradient <= options.gradient_tolerance) return bundle_status::converged;
      switch (damping_.advance(state, view, workspace_)) {
        case step_outcome::taken: break;
        case step_outcome::stationary: return bundle_status::converged;
        case step_outcome::exhausted: return bundle_status::no_progress;
        case step_outcome::singular:
          summary.where = equations_.failed_camera();
          return bundle_status::undetermined_pose;
      }
      const double before = equations_.cost();
      const double gain = before - equations_.tried_cost();
      if (!(gain >= 0.0)) return bundle_status::no_progress;
      equations_.accept();
      ++summary.iterations;
      summary.final_cost = equations_.cost();
      report(std::as_const(summary));
      if (gain <= options.relative_tolerance * before) return bundle_status::converged;
      if (k + 1 != limit) view.linearize();
    }
    return bundle_status::iteration_limit;
  }

  equations_type equations_;
  Damping damping_;
  step_workspace workspace_;
  std::span<const observation> observations_;  // of the last call of `solve`
  std::vector<std::uint8_t> fixed_;            // of the structure
  std::vector<typename Residual::view> chi2_views_;
};

template <bundle_residual Residual, robust_loss Loss, general_damping_policy Damping, reduced_solver ReducedSolver>
template <class Policy, class Report>
bundle_summary bundle_adjuster<Residual, Loss, Damping, ReducedSolver>::run(
    const Policy& policy, std::span<camera_state> cameras, std::span<vec3> points, const bundle_options& options,
    const progress& callback, Report& report, bundle_summary& summary) {
  assert(options.fixed_points.empty() || options.fixed_points.size() == points.size());
  assert(options.ignored.empty() || options.ignored.size() == observations_.size());
  {
    const detail::stage_watch watch{summary.seconds.set_up};
    if (!has_finite_cameras(cameras, summary)) return summary;
    count_unusable(options.ignored, summary);
    equations_.begin(policy, cameras, points, options, summary);
  }
  if (summary.observations == 0 || !equations_.moves_anything()) return summary;
  const int linear_before = equations_.reduced().iterations();
  problem<Policy> view{equations_, policy, summary};
  view.linearize();
  summary.initial_cost = summary.final_cost = equations_.cost();
  summary.status = bundle_status::iteration_limit;
  report(std::as_const(summary));
  summary.status = iterate(view, options, callback, summary, report);
  summary.linear_iterations = equations_.reduced().iterations() - linear_before;
  if (summary.iterations != 0) equations_.write(cameras, points);
  return summary;
}

template <class Residual>
bundle_adjuster(Residual) -> bundle_adjuster<Residual>;
template <class Residual, class Loss>
bundle_adjuster(Residual, Loss) -> bundle_adjuster<Residual, Loss>;
template <class Residual, class Loss, class Damping>
bundle_adjuster(Residual, Loss, Damping) -> bundle_adjuster<Residual, Loss, Damping>;
template <class Residual, class Loss, class Damping, class ReducedSolver>
bundle_adjuster(Residual, Loss, Damping, ReducedSolver) -> bundle_adjuster<Residual, Loss, Damping, ReducedSolver>;

}  // namespace orbis::optimize

#ifdef ORBIS_COMPILED
#include <orbis/optimize/detail/compiled/bundle_adjustment.hpp>
#endif

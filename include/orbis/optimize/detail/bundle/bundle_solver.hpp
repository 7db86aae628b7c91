// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The main loop of bundle adjustment: the implementation of `bundle_adjuster`.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <orbis/core/execution.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/bundle_problem.hpp>
#include <orbis/optimize/detail/bundle/bundle_equations.hpp>
#include <orbis/optimize/detail/stage_watch.hpp>
#include <orbis/optimize/solver_policies.hpp>

namespace orbis::optimize::detail {

template <class Residual, class Loss, class Damping>
class bundle_solver {
 public:
  using camera_state = typename Residual::camera_state;
  using observation = typename Residual::observation;

  bundle_solver(Residual residual, Loss loss, Damping damping, const reduced_solver_options& reduced)
      : equations_{std::move(residual), std::move(loss), reduced}, damping_{std::move(damping)} {}

  [[nodiscard]] double chi2(const camera_state& camera, const vec3& point, const observation& o) const {
    return chi2_in(equations_.residual().prepare(camera), point, o);
  }

  void chi2(std::span<const camera_state> cameras, std::span<const vec3> points,
            std::span<const observation> observations, std::span<double> out) {
    assert(out.size() >= observations.size());
    chi2_views_.resize(cameras.size());
    for (std::size_t c = 0; c != cameras.size(); ++c) chi2_views_[c] = equations_.residual().prepare(cameras[c]);
    for (std::size_t k = 0; k != observations.size(); ++k)
      out[k] = chi2_in(chi2_views_[observations[k].pose], points[observations[k].point], observations[k]);
  }

  template <class Policy, class Report>
  bundle_summary solve(const Policy& policy, std::span<camera_state> cameras, std::span<vec3> points,
                       std::span<const observation> observations, const bundle_options& options,
                       const progress& callback, Report& report) {
    bundle_summary summary;
    {
      const stage_watch watch{summary.seconds.set_up};
      if (!check(cameras.size(), points.size(), observations, summary)) return summary;
      set_up(cameras.size(), points.size(), observations, options);
    }
    return run(policy, cameras, points, options, callback, report, summary);
  }

  template <class Policy, class Report>
  bundle_summary solve_again(const Policy& policy, std::span<camera_state> cameras, std::span<vec3> points,
                             const bundle_options& options, const progress& callback, Report& report) {
    assert(cameras.size() == equations_.structure().count.size());
    bundle_summary summary;
    if (!std::equal(fixed_.begin(), fixed_.end(), options.fixed_poses.begin(), options.fixed_poses.end())) {
      const stage_watch watch{summary.seconds.set_up};
      set_up(cameras.size(), points.size(), observations_, options);
    }
    return run(policy, cameras, points, options, callback, report, summary);
  }

 private:
  using equations_type = bundle_equations<Residual, Loss>;

  /// The interface through which damping policies access the equations.
  template <class Policy>
  struct problem {
    equations_type& equations;
    const Policy& policy;
    bundle_summary& summary;

    void linearize() {
      const stage_watch watch{summary.seconds.linearize};
      equations.linearize(policy);
      summary.gradient = 0.0;
      const Eigen::VectorXd& g = equations.gradient();
      for (Eigen::Index i = 0; i != g.size(); ++i) summary.gradient = std::max(summary.gradient, std::abs(g[i]));
    }
    [[nodiscard]] double cost() const { return equations.cost(); }
    [[nodiscard]] const Eigen::VectorXd& gradient() const { return equations.gradient(); }
    [[nodiscard]] const Eigen::VectorXd& diagonal() const { return equations.diagonal(); }
    [[nodiscard]] double curvature(const Eigen::VectorXd& x) const { return equations.curvature(x); }
    [[nodiscard]] bool factor(const Eigen::VectorXd& damping) {
      {
        const stage_watch watch{summary.seconds.schur};
        if (!equations.eliminate(policy, damping)) return false;
      }
      const stage_watch watch{summary.seconds.factor};
      return equations.factor();
    }
    void newton_step(Eigen::VectorXd& out) {
      {
        const stage_watch watch{summary.seconds.solve};
        equations.solve_cameras(out);
      }
      const stage_watch watch{summary.seconds.back_substitute};
      equations.solve_points(policy, out);
    }
    [[nodiscard]] double try_step(const Eigen::VectorXd& step) {
      const stage_watch watch{summary.seconds.evaluate};
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

  /// Counts the unusable observations.
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
                     const bundle_options& options, const progress& callback, Report& report, bundle_summary& summary) {
    assert(options.fixed_points.empty() || options.fixed_points.size() == points.size());
    assert(options.ignored.empty() || options.ignored.size() == observations_.size());
    {
      const stage_watch watch{summary.seconds.set_up};
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
  std::span<const observation> observations_;  // observations of the last call to `solve`
  std::vector<std::uint8_t> fixed_;            // fixed cameras of the structure
  std::vector<typename Residual::view> chi2_views_;
};

}  // namespace orbis::optimize::detail

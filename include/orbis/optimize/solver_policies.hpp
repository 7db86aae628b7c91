// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Policies of the solvers of bundle adjustment and pose graphs: step strategies (Gauss-Newton, Levenberg-Marquardt,
/// dogleg), and solvers for the reduced system of bundle adjustment (dense, sparse, iterative).
///
/// Sources: K. Madsen, H. B. Nielsen, O. Tingleff, "Methods for non-linear least squares problems",
/// 2nd edition, DTU 2004; M. J. D. Powell, "A hybrid method for nonlinear equations", 1970.
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>

#include <Eigen/Core>

#include <orbis/optimize/detail/sum_over.hpp>

namespace orbis::optimize {

/// A problem linearised at its current estimate: it provides the cost at this estimate, the gradient `g`, and the
/// positive semidefinite matrix `H` of the model `cost + g^T s + s^T H s / 2`. `factor(d)` factorises `H + diag(d)` (an
/// empty `d` means 0) and returns true if it is positive definite; `newton_step(x)` then sets `x` to the solution for
/// the right-hand side `-g`. `try_step(s)` returns the true cost after a step; not finite if it is undefined.
template <class P>
concept stepped_problem = requires(P& problem, const Eigen::VectorXd& in, Eigen::VectorXd& out) {
  { problem.cost() } -> std::same_as<double>;
  { problem.gradient() } -> std::same_as<const Eigen::VectorXd&>;
  { problem.diagonal() } -> std::same_as<const Eigen::VectorXd&>;
  { problem.curvature(in) } -> std::same_as<double>;
  { problem.factor(in) } -> std::same_as<bool>;
  {problem.newton_step(out)};
  { problem.try_step(in) } -> std::same_as<double>;
};

enum class step_outcome {
  taken,       ///< accept the last attempted step
  stationary,  ///< the predicted decrease is below the rounding error
  exhausted,   ///< no step reduces the cost
  singular     ///< H is not positive definite
};

/// Reusable memory of the policies.
struct step_workspace {
  Eigen::VectorXd step, damping, metric, newton, cauchy, scratch;
};

namespace detail {
/// A problem with exactly the members that a policy may use; needed only by the concept below and never constructed.
struct any_stepped_problem {
  double cost() const;
  const Eigen::VectorXd& gradient() const;
  const Eigen::VectorXd& diagonal() const;
  double curvature(const Eigen::VectorXd&) const;
  bool factor(const Eigen::VectorXd&);
  void newton_step(Eigen::VectorXd&);
  double try_step(const Eigen::VectorXd&);
};
}  // namespace detail

/// A step strategy for any `stepped_problem`. `state` persists between the steps of one solve.
template <class D>
concept damping_policy = std::copyable<D> && std::default_initializable<typename D::state> &&
    requires(const D& d, typename D::state& s, detail::any_stepped_problem& problem, step_workspace& w) {
  { d.advance(s, problem, w) } -> std::same_as<step_outcome>;
};

namespace detail {

/// Returns true if a decrease is below the rounding error of a sum of squares.
[[nodiscard]] inline bool is_rounding(double decrease, double cost) { return decrease <= 1e-14 * cost; }

/// Returns the outcome when the predicted decrease is below the rounding error: `stationary`, unless the step is short
/// only because of the damping. Uses the diagonal of H, which bounds the decrease.
template <class P>
[[nodiscard]] step_outcome bottom_or_stuck(P& problem) {
  double promise = 0.0;
  for (Eigen::Index i = 0; i != problem.gradient().size(); ++i)
    if (const double g = problem.gradient()[i]; g != 0.0) promise += 0.5 * g * g / problem.diagonal()[i];
  return promise <= 1e-12 * problem.cost() ? step_outcome::stationary : step_outcome::exhausted;
}

/// Sets `out[i] = value(i)` for every unknown.
template <class Value>
void set_each(Eigen::VectorXd& out, Eigen::Index size, const Value& value) {
  if (out.size() != size) out.resize(size);
  double* const to = out.data();
  for (Eigen::Index i = 0; i != size; ++i) to[i] = value(i);
}
[[nodiscard]] inline double dot_product(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  const double *const p = a.data(), *const q = b.data();
  return sum_over(static_cast<std::size_t>(a.size()), [&](std::size_t i) { return p[i] * q[i]; });
}

/// Sets `out` to the diagonal of H, a metric that makes the steps invariant to the units of the unknowns.
template <class P>
void set_metric(P& problem, Eigen::VectorXd& out) {
  const Eigen::VectorXd& diagonal = problem.diagonal();
  double most = 0.0;
  for (Eigen::Index i = 0; i != diagonal.size(); ++i) most = std::max(most, diagonal[i]);
  const double least = std::max(1e-12 * most, std::numeric_limits<double>::min());
  set_each(out, diagonal.size(), [&](Eigen::Index i) { return std::max(diagonal[i], least); });
}

}  // namespace detail

/// Steps to the minimum of the model, even if the true cost increases.
struct gauss_newton {
  struct state {};

  template <stepped_problem P>
  [[nodiscard]] step_outcome advance(state&, P& problem, step_workspace& w) const {
    const Eigen::VectorXd none;
    if (!problem.factor(none)) return step_outcome::singular;
    problem.newton_step(w.step);
    if (detail::is_rounding(-0.5 * detail::dot_product(problem.gradient(), w.step), problem.cost()))
      return step_outcome::stationary;
    return std::isfinite(problem.try_step(w.step)) ? step_outcome::taken : step_outcome::exhausted;
  }
};

/// Steps to the minimum of the model with `lambda * diag(H)` added to H; `lambda` decreases after accurate predictions
/// and increases after inaccurate ones.
struct levenberg_marquardt {
  double initial = 1e-5;  ///< initial lambda
  int max_attempts = 16;  ///< maximum number of rejected steps

  struct state {
    double lambda = -1.0;
    double growth = 2.0;
  };

  template <stepped_problem P>
  [[nodiscard]] step_outcome advance(state& s, P& problem, step_workspace& w) const {
    detail::set_metric(problem, w.metric);
    if (s.lambda < 0.0) s.lambda = initial;
    for (int attempt = 0; attempt != max_attempts; ++attempt) {
      detail::set_each(w.damping, w.metric.size(), [&](Eigen::Index i) { return s.lambda * w.metric[i]; });
      if (problem.factor(w.damping)) {
        problem.newton_step(w.step);
        const Eigen::VectorXd& g = problem.gradient();
        const double *const d = w.step.data(), *const damping = w.damping.data(), *const gradient = g.data();
        const double predicted = 0.5 * detail::sum_over(static_cast<std::size_t>(g.size()), [&](std::size_t i) {
                                   return (d[i] * damping[i] - gradient[i]) * d[i];
                                 });
        if (detail::is_rounding(predicted, problem.cost())) return detail::bottom_or_stuck(problem);
        const double gain = (problem.cost() - problem.try_step(w.step)) / predicted;
        if (gain > 0.0) {
          const double better = 2.0 * gain - 1.0;
          s.lambda *= std::max(1.0 / 3.0, 1.0 - better * better * better);
          s.lambda = std::max(s.lambda, 1e-20);
          s.growth = 2.0;
          return step_outcome::taken;
        }
      }
      s.lambda = std::max(s.lambda, 1e-15) * s.growth;
      s.growth *= 2.0;
    }
    return step_outcome::exhausted;
  }
};

/// Steps between steepest descent and the minimum of the model, within a trust region. A rejected step needs no new
/// factorisation.
struct dogleg {
  double initial_radius = 0.0;  ///< initial trust region radius; 0: the length of the first Gauss-Newton step
  int max_attempts = 30;        ///< maximum number of rejected steps

  struct state {
    double radius = -1.0;
  };

  template <stepped_problem P>
  [[nodiscard]] step_outcome advance(state& s, P& problem, step_workspace& w) const {
    detail::set_metric(problem, w.metric);
    if (!find_newton(problem, w)) return step_outcome::singular;
    const Eigen::VectorXd& g = problem.gradient();
    const Eigen::Index n = g.size();
    detail::set_each(w.cauchy, n, [&](Eigen::Index i) { return -(g[i] / w.metric[i]); });
    const double along = problem.curvature(w.cauchy);
    const double stretch = along > 0.0 ? -detail::dot_product(g, w.cauchy) / along : 0.0;
    detail::set_each(w.cauchy, n, [&](Eigen::Index i) { return w.cauchy[i] * stretch; });
    const double newton = length(w.newton, w), cauchy = length(w.cauchy, w);
    if (s.radius < 0.0) s.radius = initial_radius > 0.0 ? initial_radius : newton;

    for (int attempt = 0; attempt != max_attempts; ++attempt) {
      if (newton <= s.radius) {
        detail::set_each(w.step, n, [&](Eigen::Index i) { return w.newton[i]; });
      } else if (cauchy >= s.radius) {
        const double part = s.radius / cauchy;
        detail::set_each(w.step, n, [&](Eigen::Index i) { return part * w.cauchy[i]; });
      } else {  // intersection of the leg with the trust region
        detail::set_each(w.scratch, n, [&](Eigen::Index i) { return w.newton[i] - w.cauchy[i]; });
        const double a = square(w.scratch, w);
        const double b = weighted_dot(w.scratch, w.metric, w.cauchy);
        const double c = cauchy * cauchy - s.radius * s.radius;
        const double part = -c / (b + std::sqrt(b * b - a * c));
        detail::set_each(w.step, n, [&](Eigen::Index i) { return w.cauchy[i] + part * w.scratch[i]; });
      }
      const double predicted = -detail::dot_product(g, w.step) - 0.5 * problem.curvature(w.step);
      if (detail::is_rounding(predicted, problem.cost())) return detail::bottom_or_stuck(problem);
      const double gain = (problem.cost() - problem.try_step(w.step)) / predicted;
      const double far = length(w.step, w);
      if (gain > 0.75) s.radius = std::max(s.radius, 3.0 * far);
      if (!(gain > 0.25)) s.radius = std::min(s.radius, far) * (gain > 0.0 ? 0.5 : 0.25);
      if (gain > 0.0) return step_outcome::taken;
    }
    return step_outcome::exhausted;
  }

 private:
  [[nodiscard]] static double weighted_dot(const Eigen::VectorXd& a, const Eigen::VectorXd& weights,
                                           const Eigen::VectorXd& b) {
    const double *const p = a.data(), *const q = weights.data(), *const r = b.data();
    return detail::sum_over(static_cast<std::size_t>(a.size()), [&](std::size_t i) { return p[i] * q[i] * r[i]; });
  }
  [[nodiscard]] static double square(const Eigen::VectorXd& x, const step_workspace& w) {
    return weighted_dot(x, w.metric, x);
  }
  [[nodiscard]] static double length(const Eigen::VectorXd& x, const step_workspace& w) {
    return std::sqrt(square(x, w));
  }
  /// Computes the Gauss-Newton step, with the smallest damping that makes H positive definite.
  template <stepped_problem P>
  [[nodiscard]] static bool find_newton(P& problem, step_workspace& w) {
    const Eigen::VectorXd none;
    bool definite = problem.factor(none);
    for (double lambda = 1e-10; !definite && lambda <= 1.0; lambda *= 100.0) {
      detail::set_each(w.damping, w.metric.size(), [&](Eigen::Index i) { return lambda * w.metric[i]; });
      definite = problem.factor(w.damping);
    }
    if (!definite) return false;
    problem.newton_step(w.newton);
    return true;
  }
};

/// Choice of the solver for the reduced system of bundle adjustment: a dense factorisation for up to `dense_limit`
/// cameras, which takes about (C n)^3 / 6 multiplications for n cameras with C unknowns each and is the fastest method
/// for up to about a hundred cameras with many common points; a block-sparse factorisation in a fill-reducing order if
/// the factor has at most `fill_limit` blocks, which is typical of thousands of cameras along a path; otherwise
/// conjugate gradients with a block-diagonal preconditioner and inexact steps.
struct reduced_solver_options {
  std::size_t dense_limit = 100;
  std::size_t fill_limit = 2'000'000;
  double relative_tolerance = 1e-6;  ///< conjugate gradients: residual norm relative to that of the right-hand side
  int max_iterations = 500;          ///< maximum number of conjugate gradient iterations
};

}  // namespace orbis::optimize

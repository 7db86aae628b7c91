// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How a nonlinear least-squares problem is stepped downhill: Gauss-Newton, Levenberg-Marquardt and
/// dogleg, as policies over anything that can linearise, factor and solve.
///
/// Sources: K. Madsen, H. B. Nielsen, O. Tingleff, "Methods for non-linear least squares problems",
/// 2nd edition, DTU 2004; M. J. D. Powell, "A hybrid method for nonlinear equations", 1970.
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>

#include <Eigen/Core>

namespace orbis::optimize {

namespace detail {
template <class P>
concept solves_newton = requires(P& problem, Eigen::VectorXd& out) {
  {problem.newton_step(out)};
};
template <class P>
concept solves = solves_newton<P> || requires(P& problem, Eigen::VectorXd& out) {
  {problem.solve(out)};
};
}  // namespace detail

/// A problem linearised at its current estimate: the cost there, its gradient `g` and the positive
/// semidefinite `H` of the model `cost + g^T s + s^T H s / 2`. `factor(d)` prepares `H + diag(d)` (an
/// empty `d` is 0) and says whether that is positive definite; `solve(x)` then replaces `x`. Instead of
/// `solve` a problem may have `newton_step(x)`, which makes `x` the solution for the right-hand side `-g`.
/// `try_step(s)` is the true cost one step away, not finite where there is none.
template <class P>
concept stepped_problem = requires(P& problem, const Eigen::VectorXd& in, Eigen::VectorXd& out) {
  { problem.cost() } -> std::same_as<double>;
  { problem.gradient() } -> std::same_as<const Eigen::VectorXd&>;
  { problem.diagonal() } -> std::same_as<const Eigen::VectorXd&>;
  { problem.curvature(in) } -> std::same_as<double>;
  { problem.factor(in) } -> std::same_as<bool>;
  requires detail::solves<P>;
  { problem.try_step(in) } -> std::same_as<double>;
};

enum class step_outcome {
  taken,       ///< the step last tried is to be kept
  stationary,  ///< the model promises nothing that arithmetic could tell from 0
  exhausted,   ///< no step was found that lowers the cost
  singular     ///< H is not positive definite
};

/// Memory of the policies, kept from step to step.
struct step_workspace {
  Eigen::VectorXd step, damping, metric, newton, cauchy, scratch;
};

/// What "far" means for the damped policies.
enum class step_metric {
  identity,  ///< metres and radians alike
  diagonal   ///< by the diagonal of H: invariant to the units
};

/// A way to step; `state` carries what it has learned from one step to the next.
template <class D, class P>
concept damping_policy = std::copyable<D> && std::default_initializable<typename D::state> &&
    requires(const D& d, typename D::state& s, P& problem, step_workspace& w) {
  { d.advance(s, problem, w) } -> std::same_as<step_outcome>;
};

namespace detail {
/// The least that a policy may count on; never made.
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

/// One for every problem: what the solvers take.
template <class D>
concept general_damping_policy = damping_policy<D, detail::any_stepped_problem>;

namespace detail {

/// A decrease that no rounding of a sum of squares resolves.
[[nodiscard]] inline bool is_rounding(double decrease, double cost) { return decrease <= 1e-14 * cost; }

/// What to call it when the model promises a decrease that no rounding resolves: the bottom, unless it
/// is only the damping that keeps the step short. By the diagonal of H alone, which bounds it.
template <class P>
[[nodiscard]] step_outcome bottom_or_stuck(P& problem) {
  double promise = 0.0;
  for (Eigen::Index i = 0; i != problem.gradient().size(); ++i)
    if (const double g = problem.gradient()[i]; g != 0.0) promise += 0.5 * g * g / problem.diagonal()[i];
  return promise <= 1e-12 * problem.cost() ? step_outcome::stationary : step_outcome::exhausted;
}

/// `out = -(H + D)^-1 g` for the D last factored.
template <class P>
void newton_step(P& problem, Eigen::VectorXd& out) {
  if constexpr (solves_newton<P>) {
    problem.newton_step(out);
  } else {
    out = -problem.gradient();
    problem.solve(out);
  }
}

template <class P>
void set_metric(step_metric metric, P& problem, Eigen::VectorXd& out) {
  const Eigen::VectorXd& diagonal = problem.diagonal();
  if (metric == step_metric::identity) {
    out.setOnes(diagonal.size());
    return;
  }
  const double least = std::max(1e-12 * diagonal.maxCoeff(), std::numeric_limits<double>::min());
  out = diagonal.cwiseMax(least);
}

}  // namespace detail

/// The minimum of the model, whatever the true cost says of it.
struct gauss_newton {
  struct state {};

  template <stepped_problem P>
  [[nodiscard]] step_outcome advance(state&, P& problem, step_workspace& w) const {
    const Eigen::VectorXd none;
    if (!problem.factor(none)) return step_outcome::singular;
    detail::newton_step(problem, w.step);
    if (detail::is_rounding(-0.5 * problem.gradient().dot(w.step), problem.cost())) return step_outcome::stationary;
    return std::isfinite(problem.try_step(w.step)) ? step_outcome::taken : step_outcome::exhausted;
  }
};

/// The minimum of the model with `lambda * D` added to H; `lambda` follows how good the model was.
struct levenberg_marquardt {
  double initial = 1e-5;  ///< first lambda; times the largest diagonal entry of H for the identity metric
  step_metric metric = step_metric::diagonal;
  int max_attempts = 16;  ///< steps tried before giving up

  struct state {
    double lambda = -1.0;
    double growth = 2.0;
  };

  template <stepped_problem P>
  [[nodiscard]] step_outcome advance(state& s, P& problem, step_workspace& w) const {
    detail::set_metric(metric, problem, w.metric);
    if (s.lambda < 0.0) s.lambda = initial * (metric == step_metric::identity ? problem.diagonal().maxCoeff() : 1.0);
    for (int attempt = 0; attempt != max_attempts; ++attempt) {
      w.damping = s.lambda * w.metric;
      if (problem.factor(w.damping)) {
        detail::newton_step(problem, w.step);
        w.scratch = w.step.cwiseProduct(w.damping);
        const double predicted = 0.5 * (w.scratch.dot(w.step) - problem.gradient().dot(w.step));
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

/// Between the steepest descent and the minimum of the model, within a radius in which it holds. A
/// step that was too bold costs no factorisation.
struct dogleg {
  double initial_radius = 0.0;  ///< 0: as far as the first Gauss-Newton step goes
  step_metric metric = step_metric::diagonal;
  int max_attempts = 30;  ///< steps tried before giving up

  struct state {
    double radius = -1.0;
  };

  template <stepped_problem P>
  [[nodiscard]] step_outcome advance(state& s, P& problem, step_workspace& w) const {
    detail::set_metric(metric, problem, w.metric);
    if (!find_newton(problem, w)) return step_outcome::singular;
    const Eigen::VectorXd& g = problem.gradient();
    w.cauchy = -g.cwiseQuotient(w.metric);
    const double along = problem.curvature(w.cauchy);
    w.cauchy *= along > 0.0 ? -g.dot(w.cauchy) / along : 0.0;
    const double newton = length(w.newton, w), cauchy = length(w.cauchy, w);
    if (s.radius < 0.0) s.radius = initial_radius > 0.0 ? initial_radius : newton;

    for (int attempt = 0; attempt != max_attempts; ++attempt) {
      if (newton <= s.radius) {
        w.step = w.newton;
      } else if (cauchy >= s.radius) {
        w.step = (s.radius / cauchy) * w.cauchy;
      } else {
        w.scratch = w.newton - w.cauchy;  // where does the leg leave the region?
        const double a = square(w.scratch, w);
        const double b = weighted_dot(w.scratch, w.metric, w.cauchy);
        const double c = cauchy * cauchy - s.radius * s.radius;
        w.step = w.cauchy + (-c / (b + std::sqrt(b * b - a * c))) * w.scratch;
      }
      const double predicted = -g.dot(w.step) - 0.5 * problem.curvature(w.step);
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
  template <class Vector>
  [[nodiscard]] static double weighted_dot(const Vector& a, const Vector& weights, const Vector& b) {
    return a.cwiseProduct(weights).dot(b);
  }
  template <std::same_as<double> S = double>  // so that only who steps so has it compiled
  [[nodiscard]] static double square(const Eigen::VectorXd& x, const step_workspace& w) {
    return weighted_dot(x, w.metric, x);
  }
  template <std::same_as<double> S = double>
  [[nodiscard]] static double length(const Eigen::VectorXd& x, const step_workspace& w) {
    return std::sqrt(square<S>(x, w));
  }
  /// With as little damping as makes H positive definite.
  template <stepped_problem P>
  [[nodiscard]] static bool find_newton(P& problem, step_workspace& w) {
    const Eigen::VectorXd none;
    bool definite = problem.factor(none);
    for (double lambda = 1e-10; !definite && lambda <= 1.0; lambda *= 100.0) {
      w.damping = lambda * w.metric;
      definite = problem.factor(w.damping);
    }
    if (!definite) return false;
    detail::newton_step(problem, w.newton);
    return true;
  }
};

static_assert(general_damping_policy<gauss_newton> && general_damping_policy<levenberg_marquardt> &&
              general_damping_policy<dogleg>);

}  // namespace orbis::optimize

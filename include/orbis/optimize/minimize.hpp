// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Small dense least-squares problems: one point on a manifold of a few dimensions, any number of
/// residuals, everything on the stack.
///
/// Source: K. Madsen, H. B. Nielsen, O. Tingleff, "Methods for non-linear least squares problems", 2nd
/// edition, DTU 2004.
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <optional>
#include <ranges>
#include <string_view>
#include <tuple>
#include <type_traits>

#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/sparse/small_cholesky.hpp>
#include <orbis/optimize/graduated.hpp>
#include <orbis/optimize/manifold.hpp>
#include <orbis/optimize/robust_loss.hpp>

namespace orbis::optimize {

/// `r.residual(p)`: `R::dimension` whitened numbers, or empty where there are none at `p`;
/// `r.linearize(p, jacobian)`: the same with the derivatives by a step in the whole tangent space at `p`.
/// `automatic`, `prior` and `point_to_plane` are such residuals.
template <class R, class M>
concept residual_on = manifold<M> &&
    requires(const R& r, const typename M::point& p, matrix<R::dimension, M::full_dimension>& jacobian) {
  { r.residual(p) } -> std::convertible_to<std::optional<matrix<R::dimension>>>;
  { r.linearize(p, jacobian) } -> std::convertible_to<std::optional<matrix<R::dimension>>>;
};

/// What `minimize` takes: a residual, a range of residuals of one type, or a tuple of either.
template <class R, class M>
concept residuals_on = residual_on<R, M> || requires {
  std::tuple_size<R>::value;
} ||(std::ranges::input_range<const R>&& residual_on<std::ranges::range_value_t<const R>, M>);

enum class minimize_status {
  converged,        ///< no step lowers the cost by more than the tolerance
  iteration_limit,  ///< the number of steps was reached
  undetermined,     ///< the residuals leave a direction free; what they do determine has converged
  no_residuals,     ///< not one residual has a value at the start
  invalid_start     ///< cost or derivatives at the start are not finite
};

[[nodiscard]] constexpr std::string_view to_string(minimize_status status) noexcept {
  switch (status) {
    case minimize_status::converged: return "converged";
    case minimize_status::iteration_limit: return "iteration limit";
    case minimize_status::undetermined: return "undetermined";
    case minimize_status::no_residuals: return "no residuals";
    case minimize_status::invalid_start: return "invalid start";
  }
  return "unknown";
}

struct minimize_options {
  int max_iterations = 50;            ///< of each stage of the loss
  double relative_tolerance = 1e-12;  ///< of the cost: a step that lowers it by less ends a stage
  double damping = 1e-6;              ///< first lambda, times the diagonal; 0 starts with Gauss-Newton
};

struct minimize_summary {
  minimize_status status = minimize_status::no_residuals;
  double initial_cost = 0.0;  ///< half the robust sum at the start, under the last stage's loss
  double final_cost = 0.0;    ///< at the end; never above `initial_cost` for a loss of one stage
  int iterations = 0;         ///< steps taken
  int residuals = 0;          ///< that had a value at the end
  [[nodiscard]] bool ok() const noexcept {
    return status == minimize_status::converged || status == minimize_status::iteration_limit;
  }
};

namespace detail {

/// Normal equations of a small problem.
template <class M>
struct small_equations {
  static constexpr int n = M::dimension;
  matrix<n, n> h = matrix<n, n>::Zero();
  matrix<n> g = matrix<n>::Zero();
  double cost = 0.0;
  int count = 0;  ///< residuals with a value

  [[nodiscard]] bool is_finite() const { return std::isfinite(cost) && h.allFinite() && g.allFinite(); }

  /// Adds a residual, every residual of a range, or everything in a tuple.
  template <class R, class Loss>
  void add(const M& m, const typename M::point& p, const R& r, const Loss& loss) {
    if constexpr (residual_on<R, M>) {
      matrix<R::dimension, M::full_dimension> whole;
      const std::optional<matrix<R::dimension>> value = r.linearize(p, whole);
      if (!value) return;
      const double squared = value->squaredNorm();
      cost += 0.5 * loss.cost(squared);
      const matrix<R::dimension, n> j = m.reduce(whole);
      const matrix<n, R::dimension> weighted = loss.weight(squared) * j.transpose();
      h.noalias() += weighted * j;
      g.noalias() += weighted * *value;
      ++count;
    } else if constexpr (std::ranges::input_range<const R>) {
      for (const auto& one : r) add(m, p, one, loss);
    } else {
      std::apply([&](const auto&... part) { (add(m, p, part, loss), ...); }, r);
    }
  }
};

}  // namespace detail

/// Moves `x` to a local minimum of half the sum of `loss` over the squared norms of `residuals`, by
/// Levenberg-Marquardt; a step that makes a residual lose its value is not taken. With a `loss_schedule` one
/// stage after the other. `x` is touched only by steps that lower the cost. Nothing is allocated (unless the
/// residuals do so). O(residuals + dimension^3) for every step.
template <manifold M, residuals_on<M> Residuals, loss_or_schedule Loss = trivial>
minimize_summary minimize(const M& space, typename M::point& x, const Residuals& residuals,
                          const minimize_options& options = {}, const Loss& loss = {}) {
  using equations = detail::small_equations<M>;
  const auto linearize = [&](const typename M::point& at, const auto& rho) {
    equations e;
    e.add(space, at, residuals, rho);
    return e;
  };

  minimize_summary out;
  const auto final_loss = stage_of(loss, std::max(0, stages_of(loss) - 1));
  const equations start = linearize(x, final_loss);
  out.initial_cost = out.final_cost = start.cost;
  out.residuals = start.count;
  if (start.count == 0) return out;
  out.status = minimize_status::invalid_start;
  if (!start.is_finite()) return out;

  // Steps that the model says are worth nothing, by rounding.
  constexpr double negligible = 1e-15;
  for (int stage = 0; stage < std::max(1, stages_of(loss)); ++stage) {
    const auto rho = stage_of(loss, stage);
    equations now = linearize(x, rho);
    double lambda = options.damping, growth = 2.0;
    out.status = minimize_status::iteration_limit;
    for (int k = 0; k < options.max_iterations; ++k) {
      small_cholesky<M::dimension> cholesky;
      matrix<M::dimension, M::dimension> h = now.h;
      const bool determined = cholesky.set(h) && cholesky.factor(0.0) > cholesky.determined;
      if (!determined) {  // the shortest step then, so that nothing moves what nothing holds
        const double largest = h.diagonal().maxCoeff();
        h.diagonal().array() += largest > 0.0 ? 1e-8 * largest : 1.0;
        if (!cholesky.set(h)) return out;
      }

      bool accepted = false, stationary = false;
      double gain = 0.0;
      for (int attempt = 0; attempt != 30 && !accepted && !stationary; ++attempt) {
        if (cholesky.factor(lambda) > 0.0) {
          const matrix<M::dimension> step = cholesky.solve(-now.g);
          const matrix<M::dimension> stretched = h.diagonal().cwiseProduct(step);
          const double predicted = 0.5 * (lambda * step.dot(stretched) - step.dot(now.g));
          stationary = !(predicted > negligible * now.cost) && lambda <= 1.0;
          if (stationary) break;
          const typename M::point there = space.retract(x, step);
          const equations then = linearize(there, rho);
          if (then.is_finite() && then.count >= now.count && then.cost < now.cost) {
            accepted = true;
            gain = now.cost - then.cost;
            const double better = 2.0 * gain / predicted - 1.0;
            lambda *= std::max(1.0 / 3.0, 1.0 - better * better * better);
            growth = 2.0;
            x = there;
            now = then;
            break;
          }
        }
        lambda = std::max(lambda, 1e-10) * growth;
        growth *= 2.0;
      }
      if (accepted) ++out.iterations;
      if (!accepted || gain <= options.relative_tolerance * now.cost) {
        out.status = determined ? minimize_status::converged : minimize_status::undetermined;
        break;
      }
    }
    out.final_cost = now.cost;
    out.residuals = now.count;
  }
  return out;
}

}  // namespace orbis::optimize

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Robust losses: how much a residual may still pull on the estimate when it is large.
///
/// A loss maps the *squared* norm `s` of a whitened residual to `rho(s)`, with `rho(s) ~ s` near 0;
/// the cost of a problem is half the sum of `rho`. Widths are in units of the residual itself, not
/// of its square: `huber{2.0}` turns linear where the residual is 2; they are positive. In iteratively reweighted
/// least squares a residual is weighted by `rho'(s)`.
///
/// Sources: Z. Zhang, "Parameter estimation techniques: a tutorial with application to conic
/// fitting", Image and Vision Computing 15 (1997); M. J. Black, A. Rangarajan, "On the unification of
/// line processes, outlier rejection, and robust statistics", IJCV 19(1), 1996.
#pragma once

#include <cmath>
#include <concepts>

namespace orbis::optimize {

/// `loss.cost(s)` is rho(s) >= 0, `loss.weight(s)` its derivative, in [0, 1], for s >= 0.
template <class L>
concept robust_loss = std::copyable<L> && requires(const L& loss, double squared) {
  { loss.cost(squared) } -> std::same_as<double>;
  { loss.weight(squared) } -> std::same_as<double>;
};

/// Least squares.
struct trivial {
  [[nodiscard]] constexpr double cost(double squared) const noexcept { return squared; }
  [[nodiscard]] constexpr double weight(double) const noexcept { return 1.0; }
};

/// Quadratic up to `width`, linear beyond it. Convex.
struct huber {
  double width = 1.0;
  [[nodiscard]] double cost(double squared) const noexcept {
    return squared <= width * width ? squared : 2.0 * width * std::sqrt(squared) - width * width;
  }
  [[nodiscard]] double weight(double squared) const noexcept {
    return squared <= width * width ? 1.0 : width / std::sqrt(squared);
  }
};

/// Grows as the logarithm: far residuals lose their pull, never quite all of it.
struct cauchy {
  double width = 1.0;
  [[nodiscard]] double cost(double squared) const noexcept {
    return width * width * std::log1p(squared / (width * width));
  }
  [[nodiscard]] double weight(double squared) const noexcept { return 1.0 / (1.0 + squared / (width * width)); }
};

/// Tukey's biweight: residuals beyond `width` have no pull at all.
struct tukey {
  double width = 1.0;
  [[nodiscard]] double cost(double squared) const noexcept {
    const double rest = inside(squared);
    return width * width / 3.0 * (1.0 - rest * rest * rest);
  }
  [[nodiscard]] double weight(double squared) const noexcept {
    const double rest = inside(squared);
    return rest * rest;
  }

 private:
  [[nodiscard]] double inside(double squared) const noexcept {
    return squared < width * width ? 1.0 - squared / (width * width) : 0.0;
  }
};

/// Saturates as a rational function; half way to its bound where the residual is `width`.
struct geman_mcclure {
  double width = 1.0;
  [[nodiscard]] double cost(double squared) const noexcept { return squared * share(squared); }
  [[nodiscard]] double weight(double squared) const noexcept { return share(squared) * share(squared); }

 private:
  [[nodiscard]] double share(double squared) const noexcept { return width * width / (width * width + squared); }
};

/// Least squares within `width`, a constant beyond it: a hard decision, differentiable but at the width.
struct truncated {
  double width = 1.0;
  [[nodiscard]] double cost(double squared) const noexcept {
    return squared <= width * width ? squared : width * width;
  }
  [[nodiscard]] double weight(double squared) const noexcept { return squared <= width * width ? 1.0 : 0.0; }
};

static_assert(robust_loss<trivial> && robust_loss<huber> && robust_loss<cauchy> && robust_loss<tukey> &&
              robust_loss<geman_mcclure> && robust_loss<truncated>);

}  // namespace orbis::optimize

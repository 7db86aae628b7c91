// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Robust losses, which limit the influence of large residuals, and chi-squared gates against outliers.
///
/// A loss maps the *squared* norm `s` of a whitened residual to `rho(s)`, with `rho(s) ~ s` near 0. The cost of a
/// problem is half the sum of `rho`. Widths are positive and in units of the whitened residual, not of its square:
/// `huber{2.0}` becomes linear at a residual norm of 2. Iteratively reweighted least squares weights a residual by
/// `rho'(s)`.
///
/// Sources: Z. Zhang, "Parameter estimation techniques: a tutorial with application to conic
/// fitting", Image and Vision Computing 15 (1997); M. J. Black, A. Rangarajan, "On the unification of
/// line processes, outlier rejection, and robust statistics", IJCV 19(1), 1996.
#pragma once

#include <cmath>
#include <concepts>

namespace orbis::optimize {

/// A robust loss: for s >= 0, `loss.cost(s)` is rho(s) >= 0, and `loss.weight(s)` is its derivative, in [0, 1].
template <class L>
concept robust_loss = std::copyable<L> && requires(const L& loss, double squared) {
  { loss.cost(squared) } -> std::same_as<double>;
  { loss.weight(squared) } -> std::same_as<double>;
};

/// Least squares: no robust loss.
struct trivial {
  [[nodiscard]] constexpr double cost(double squared) const noexcept { return squared; }
  [[nodiscard]] constexpr double weight(double) const noexcept { return 1.0; }
};

/// Quadratic up to `width`, linear beyond. Convex.
struct huber {
  double width = 1.0;
  [[nodiscard]] double cost(double squared) const noexcept {
    return squared <= width * width ? squared : 2.0 * width * std::sqrt(squared) - width * width;
  }
  [[nodiscard]] double weight(double squared) const noexcept {
    return squared <= width * width ? 1.0 : width / std::sqrt(squared);
  }
};

/// Logarithmic: the influence of large residuals tends to zero without reaching it.
struct cauchy {
  double width = 1.0;
  [[nodiscard]] double cost(double squared) const noexcept {
    return width * width * std::log1p(squared / (width * width));
  }
  [[nodiscard]] double weight(double squared) const noexcept { return 1.0 / (1.0 + squared / (width * width)); }
};

/// Tukey's biweight: residuals beyond `width` have no influence.
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

static_assert(robust_loss<trivial> && robust_loss<huber> && robust_loss<cauchy> && robust_loss<tukey>);

/// The 95 % quantile of the chi-squared distribution: 95 % of the correct whitened residuals with `dimension` entries
/// have a squared norm below it. `dimension` is 2 for a reprojection error, 3 with depth. @pre 1 <= dimension <= 3
[[nodiscard]] constexpr double chi_squared_gate(int dimension) noexcept {
  constexpr double quantiles[] = {3.841, 5.991, 7.815};
  return quantiles[dimension - 1];
}

}  // namespace orbis::optimize

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The interval in which a distortion polynomial increases, and its inverse on that interval.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <optional>

namespace orbis::camera::detail {

/// The value of `c[0] + c[1] x + c[2] x^2 + ...`, by Horner's rule.
template <std::size_t N>
[[nodiscard]] constexpr double polynomial(const std::array<double, N>& c, double x) noexcept {
  double value = 0.0;
  for (std::size_t i = N; i-- > 0;) value = value * x + c[i];
  return value;
}

/// The smallest `x > 0` at which the polynomial changes sign; infinity if there is none. Exact to rounding: the
/// polynomial is monotonic between neighbouring roots of its derivative, which are found recursively. O(N^2)
/// bisections.
template <std::size_t N>
[[nodiscard]] double smallest_positive_root(const std::array<double, N>& c) {
  static_assert(N > 0);
  constexpr double infinity = std::numeric_limits<double>::infinity();
  // roots[d]: the positive sign changes of the (N - 1 - d)-th derivative, in order.
  std::array<double, N> roots{};
  std::size_t count = 0;
  for (std::size_t order = N - 1; order != static_cast<std::size_t>(-1); --order) {
    std::array<double, N> derivative = c;
    for (std::size_t d = 0; d != order; ++d) {
      for (std::size_t i = 1; i != N; ++i) derivative[i - 1] = derivative[i] * static_cast<double>(i);
      derivative[N - 1] = 0.0;
    }
    std::size_t degree = N - 1;
    while (degree > 0 && derivative[degree] == 0.0) --degree;
    double bound = 0.0;  // Cauchy's bound on the roots
    for (std::size_t i = 0; i != degree; ++i) bound = std::max(bound, std::abs(derivative[i] / derivative[degree]));
    bound += 1.0;

    std::array<double, N> found{};
    std::size_t found_count = 0;
    double lo = 0.0;
    for (std::size_t i = 0; i <= count; ++i) {
      const double hi = i < count ? roots[i] : std::max(bound, lo);
      double a = lo, b = hi;
      lo = hi;
      const bool negative = polynomial(derivative, a) < 0.0;
      if ((polynomial(derivative, b) < 0.0) == negative) continue;
      for (double middle; middle = a + 0.5 * (b - a), middle > a && middle < b;)
        ((polynomial(derivative, middle) < 0.0) == negative ? a : b) = middle;
      found[found_count++] = b;
    }
    roots = found;
    count = found_count;
  }
  return count > 0 ? roots[0] : infinity;
}

/// Solves `f(x) == target` for `x` in `[0, end)`, where `f(0) == 0` and `f` is increasing; `f` returns the value and
/// the derivative. Newton's method within a bracket maintained by bisection. Empty if `target` is not reached. `end`
/// may be infinite.
template <std::invocable<double> F>
[[nodiscard]] std::optional<double> invert_growing(F&& f, double target, double end) {
  if (!(target >= 0.0) || !std::isfinite(target)) return std::nullopt;
  double lo = 0.0;
  double hi = end;
  if (!std::isfinite(hi)) {
    for (hi = std::max(1.0, target); f(hi).first < target; hi *= 2.0)
      if (hi > 1e9) return std::nullopt;
  } else if (!(f(hi).first > target)) {
    return std::nullopt;
  }
  double x = std::min(target, 0.5 * (lo + hi));
  for (int i = 0; i != 100; ++i) {
    const auto [value, slope] = f(x);
    if (value == target) break;
    (value < target ? lo : hi) = x;
    double next = x - (value - target) / slope;
    // Test for convergence before the bracket: at the root, Newton's step ends on a bound of the bracket.
    if (std::abs(next - x) <= 4.0 * std::numeric_limits<double>::epsilon() * x) return std::clamp(next, lo, hi);
    if (!(next > lo && next < hi)) next = 0.5 * (lo + hi);
    x = next;
  }
  return x;
}

}  // namespace orbis::camera::detail

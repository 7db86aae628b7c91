// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// All real roots of a polynomial of small degree.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace orbis::optimize::detail {

/// Returns a root of a polynomial between `low` and `high`, where its values have opposite signs. Uses Newton's method,
/// or bisection if a step would leave the interval. `c[i]` is the coefficient of x^i.
[[nodiscard]] inline double bracketed_root(const double* c, std::size_t degree, double low, double high,
                                           double at_low) {
  double x = 0.5 * (low + high);
  for (int i = 0; i != 80; ++i) {
    double value = c[degree], slope = 0.0;
    for (std::size_t k = degree; k-- != 0;) {
      slope = slope * x + value;
      value = value * x + c[k];
    }
    if (value == 0.0) return x;
    ((value < 0.0) == (at_low < 0.0) ? low : high) = x;
    double next = x - value / slope;
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (std::fabs(next - x) <= 2e-16 * std::fabs(x) || next == low || next == high) return next;
    x = next;
  }
  return x;
}

/// Computes the roots of a polynomial within [-1, 1], ascending; returns their number. Between two adjacent roots of
/// its derivative, a polynomial has at most one root. A root of even multiplicity is reported once, and a nearby root
/// may be reported as well.
template <std::size_t Degree>
std::size_t roots_in_unit_interval(const std::array<double, Degree + 1>& c, std::array<double, Degree>& roots) {
  // The coefficients of all derivatives, starting with the linear one, each scaled by a power of 1 / Degree.
  std::array<std::array<double, Degree + 1>, Degree + 1> derivatives{};
  derivatives[Degree] = c;
  for (std::size_t d = Degree; d > 1; --d)
    for (std::size_t k = 1; k <= d; ++k)
      derivatives[d - 1][k - 1] = derivatives[d][k] * static_cast<double>(k) / static_cast<double>(Degree);
  std::array<double, Degree + 2> borders{-1.0, 1.0};
  std::size_t count = 0;
  for (std::size_t d = 1; d <= Degree; ++d) {
    const auto& p = derivatives[d];
    const auto value = [&](double x) {
      double v = p[d];
      for (std::size_t k = d; k-- != 0;) v = v * x + p[k];
      return v;
    };
    std::array<double, Degree> found{};
    std::size_t number = 0;
    double low = -1.0, at_low = value(low);
    for (std::size_t i = 0; i <= count; ++i) {
      const double high = i == count ? 1.0 : borders[i + 1];
      const double at_high = value(high);
      if (at_low == 0.0 && (number == 0 || found[number - 1] != low))
        found[number++] = low;
      else if ((at_low < 0.0) != (at_high < 0.0) && at_low != 0.0 && at_high != 0.0)
        found[number++] = bracketed_root(p.data(), d, low, high, at_low);
      else if (d == Degree && i != 0 && number < d && (number == 0 || found[number - 1] != low)) {
        // An extremum close to zero is a double root up to rounding.
        double size = 0.0;
        for (std::size_t k = d + 1; k-- != 0;) size = size * std::fabs(low) + std::fabs(p[k]);
        if (std::fabs(at_low) < 1e-11 * size) found[number++] = low;
      }
      if (number == d) break;
      low = high;
      at_low = at_high;
    }
    if (number < d && at_low == 0.0 && (number == 0 || found[number - 1] != low)) found[number++] = low;
    count = number;
    borders[0] = -1.0;
    std::copy_n(found.begin(), count, borders.begin() + 1);
    if (d == Degree) std::copy_n(found.begin(), count, roots.begin());
  }
  return count;
}

/// Computes all real roots of a polynomial; returns their number. `c[i]` is the coefficient of x^i. A root of even
/// multiplicity is reported once, and a nearby root may be reported as well. There are none if a coefficient is not
/// finite.
template <std::size_t Degree>
std::size_t real_roots(const std::array<double, Degree + 1>& c, std::array<double, Degree>& roots) {
  double largest = 0.0;
  for (const double x : c) {
    if (!std::isfinite(x)) return 0;
    largest = std::max(largest, std::fabs(x));
  }
  if (!(largest > 0.0)) return 0;
  std::size_t count = roots_in_unit_interval<Degree>(c, roots);
  // The roots outside [-1, 1] are the inverses of those of the polynomial with reversed coefficients.
  std::array<double, Degree + 1> reversed = c;
  std::reverse(reversed.begin(), reversed.end());
  std::array<double, Degree> inverses{};
  const std::size_t outside = roots_in_unit_interval<Degree>(reversed, inverses);
  for (std::size_t i = 0; i != outside && count != Degree; ++i)
    if (inverses[i] != 0.0 && std::fabs(inverses[i]) < 1.0) roots[count++] = 1.0 / inverses[i];
  return count;
}

}  // namespace orbis::optimize::detail

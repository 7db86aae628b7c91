// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Dual numbers: a value with its derivatives, carried through every operation. Exact to rounding.
///
/// Source: A. Griewank, A. Walther, "Evaluating Derivatives", 2nd edition, SIAM 2008, chapter 3
/// (forward mode).
#pragma once

#include <cmath>
#include <limits>

#include <Eigen/Core>

#include <orbis/core/types.hpp>

namespace orbis::optimize {

/// A number that depends on N others. Functions are found by argument-dependent lookup: write
/// `using std::sqrt; sqrt(x)`, or `x.sqrt()` for Eigen's arrays. Comparisons look at the value alone.
template <int N>
struct dual {
  double value = 0.0;
  matrix<N> slope = matrix<N>::Zero();  ///< the derivatives of `value`

  dual() = default;
  /// A constant.
  dual(double x) : value{x} {}  // NOLINT(google-explicit-constructor)
  dual(double x, const matrix<N>& derivatives) : value{x}, slope{derivatives} {}
  /// The i-th of the N numbers, at `x`. @pre 0 <= i < N
  [[nodiscard]] static dual variable(double x, int i) { return {x, matrix<N>::Unit(i)}; }

  dual& operator+=(const dual& b) { return *this = *this + b; }
  dual& operator-=(const dual& b) { return *this = *this - b; }
  dual& operator*=(const dual& b) { return *this = *this * b; }
  dual& operator/=(const dual& b) { return *this = *this / b; }

  friend dual operator+(const dual& a) { return a; }
  friend dual operator-(const dual& a) { return {-a.value, -a.slope}; }
  friend dual operator+(const dual& a, const dual& b) { return {a.value + b.value, a.slope + b.slope}; }
  friend dual operator-(const dual& a, const dual& b) { return {a.value - b.value, a.slope - b.slope}; }
  friend dual operator*(const dual& a, const dual& b) {
    return {a.value * b.value, a.value * b.slope + b.value * a.slope};
  }
  friend dual operator/(const dual& a, const dual& b) {
    const double quotient = a.value / b.value;
    return {quotient, (a.slope - quotient * b.slope) / b.value};
  }

  friend bool operator==(const dual& a, const dual& b) { return a.value == b.value; }
  friend auto operator<=>(const dual& a, const dual& b) { return a.value <=> b.value; }

  friend bool isfinite(const dual& a) { return std::isfinite(a.value) && a.slope.allFinite(); }
  friend bool isnan(const dual& a) { return std::isnan(a.value) || a.slope.hasNaN(); }
  friend bool isinf(const dual& a) { return std::isinf(a.value); }

  friend dual abs(const dual& a) { return a.value < 0.0 ? -a : a; }
  friend dual sqrt(const dual& a) {
    const double root = std::sqrt(a.value);
    return {root, a.slope * (0.5 / root)};
  }
  friend dual exp(const dual& a) {
    const double e = std::exp(a.value);
    return {e, e * a.slope};
  }
  friend dual log(const dual& a) { return {std::log(a.value), a.slope / a.value}; }
  friend dual log1p(const dual& a) { return {std::log1p(a.value), a.slope / (1.0 + a.value)}; }
  friend dual sin(const dual& a) { return {std::sin(a.value), std::cos(a.value) * a.slope}; }
  friend dual cos(const dual& a) { return {std::cos(a.value), -std::sin(a.value) * a.slope}; }
  friend dual tan(const dual& a) {
    const double t = std::tan(a.value);
    return {t, (1.0 + t * t) * a.slope};
  }
  friend dual asin(const dual& a) { return {std::asin(a.value), a.slope / std::sqrt(1.0 - a.value * a.value)}; }
  friend dual acos(const dual& a) { return {std::acos(a.value), -a.slope / std::sqrt(1.0 - a.value * a.value)}; }
  friend dual atan(const dual& a) { return {std::atan(a.value), a.slope / (1.0 + a.value * a.value)}; }
  friend dual sinh(const dual& a) { return {std::sinh(a.value), std::cosh(a.value) * a.slope}; }
  friend dual cosh(const dual& a) { return {std::cosh(a.value), std::sinh(a.value) * a.slope}; }
  friend dual tanh(const dual& a) {
    const double t = std::tanh(a.value);
    return {t, (1.0 - t * t) * a.slope};
  }
  friend dual atan2(const dual& y, const dual& x) {
    const double square = x.value * x.value + y.value * y.value;
    return {std::atan2(y.value, x.value), (x.value * y.slope - y.value * x.slope) / square};
  }
  friend dual hypot(const dual& a, const dual& b) {
    const double h = std::hypot(a.value, b.value);
    return {h, (a.value / h) * a.slope + (b.value / h) * b.slope};
  }
  friend dual pow(const dual& a, double b) {
    return {std::pow(a.value, b), (b == 0.0 ? 0.0 : b * std::pow(a.value, b - 1.0)) * a.slope};
  }
  friend dual pow(const dual& a, const dual& b) {
    const double p = std::pow(a.value, b.value);
    return {p, b.value * std::pow(a.value, b.value - 1.0) * a.slope + p * std::log(a.value) * b.slope};
  }
  friend dual min(const dual& a, const dual& b) { return b.value < a.value ? b : a; }
  friend dual max(const dual& a, const dual& b) { return a.value < b.value ? b : a; }
};

/// The number itself, without derivatives: for decisions.
[[nodiscard]] inline double value_of(double x) noexcept { return x; }
template <int N>
[[nodiscard]] double value_of(const dual<N>& x) noexcept {
  return x.value;
}

}  // namespace orbis::optimize

template <int N>
struct Eigen::NumTraits<orbis::optimize::dual<N>> : Eigen::NumTraits<double> {
  using Real = orbis::optimize::dual<N>;
  using NonInteger = orbis::optimize::dual<N>;
  using Nested = orbis::optimize::dual<N>;
  using Literal = orbis::optimize::dual<N>;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 1 + N,
    AddCost = 1 + N,
    MulCost = 3 + 2 * N
  };
};
template <int N, class Operation>
struct Eigen::ScalarBinaryOpTraits<orbis::optimize::dual<N>, double, Operation> {
  using ReturnType = orbis::optimize::dual<N>;
};
template <int N, class Operation>
struct Eigen::ScalarBinaryOpTraits<double, orbis::optimize::dual<N>, Operation> {
  using ReturnType = orbis::optimize::dual<N>;
};

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Similarity transforms in three dimensions: the Lie group Sim(3).
///
/// Formulas: H. Strasdat, "Local accuracy and global consistency for efficient visual SLAM", PhD thesis, Imperial
/// College London, 2012, chapter 2. The integrals are computed by Taylor series and doubling (N. J. Higham, "Functions
/// of Matrices", 2008, section 10.7.4), which needs no special cases for a zero angle or log scale.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <concepts>
#include <limits>

#include <orbis/core/se3.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>

namespace orbis {

namespace detail {

/// The sum of `a^n / (n + 1)!`, i.e. the integral of `exp(t a)` for `t` from 0 to 1.
template <int N, class S>
[[nodiscard]] matrix<N, N, S> exponential_integral(const matrix<N, N, S>& a) {
  using square = matrix<N, N, S>;
  S largest = S(0);  // sum of the magnitudes in a column
  for (int c = 0; c != N; ++c) {
    const S total = sum_entries(magnitudes(column_of(a, c)));
    if (!std::isfinite(total)) return filled<square>(std::numeric_limits<S>::quiet_NaN());
    largest = std::max(largest, total);
  }
  int doublings = 0;
  for (S n = largest; n > S(0.5); n /= S(2)) ++doublings;

  square x = a * std::ldexp(S(1), -doublings);
  square sum = identity<square>();
  square term = identity<square>();
  for (int n = 2; n != 16; ++n) {  // 0.5^15 / 16! is below the rounding error of double
    term = term * x / static_cast<S>(n);
    sum += term;
  }
  for (; doublings != 0; --doublings) {  // F(2x) = F(x) (exp(x) + 1) / 2, exp(x) = 1 + x F(x)
    sum += S(0.5) * (sum * x * sum);
    x *= S(2);
  }
  return sum;
}

}  // namespace detail

/// A similarity transform: `S_a_b * p_b == scale * (R * p_b) + t == p_a`. Tangent vectors are `(rho, phi, sigma)`:
/// translation, rotation (radians), logarithm of the scale.
template <std::floating_point S = double>
class basic_sim3 {
 public:
  using scalar = S;
  static constexpr int dof = 7;
  using tangent = matrix<7, 1, S>;
  using point = matrix<3, 1, S>;

  /// The identity.
  basic_sim3() : t_{zeros<point>()} {}
  /// @pre scale > 0
  basic_sim3(const basic_so3<S>& rotation, const point& translation, S scale)
      : r_{rotation}, t_{translation}, scale_{scale} {
    assert(!(scale < S(0)));
  }
  /// A rigid transform, with scale 1.
  explicit basic_sim3(const basic_se3<S>& rigid) : basic_sim3(rigid.rotation(), rigid.translation(), S(1)) {}

  [[nodiscard]] static basic_sim3 exp(const tangent& xi) {
    const point phi = segment<3>(xi, 3);
    return {basic_so3<S>::exp(phi), translation_integral(phi, xi[6]) * head<3>(xi), std::exp(xi[6])};
  }
  [[nodiscard]] tangent log() const {
    const point phi = r_.log();
    const S sigma = std::log(scale_);
    tangent xi;
    set_block(xi, 0, 0, orbis::inverse(translation_integral(phi, sigma)) * t_);
    set_block(xi, 3, 0, phi);
    xi[6] = sigma;
    return xi;
  }
  [[nodiscard]] basic_sim3 inverse() const {
    const basic_so3<S> r = r_.inverse();
    return {r, -(r * t_) / scale_, S(1) / scale_};
  }
  [[nodiscard]] friend basic_sim3 operator*(const basic_sim3& a, const basic_sim3& b) {
    return {a.r_ * b.r_, a * b.t_, a.scale_ * b.scale_};
  }
  [[nodiscard]] friend point operator*(const basic_sim3& s, const point& p) { return s.scale_ * (s.r_ * p) + s.t_; }

  [[nodiscard]] const basic_so3<S>& rotation() const { return r_; }
  [[nodiscard]] const point& translation() const { return t_; }
  [[nodiscard]] S scale() const { return scale_; }
  [[nodiscard]] matrix<3, 3, S> rotation_matrix() const { return r_.rotation_matrix(); }
  /// The homogeneous 4x4 matrix.
  [[nodiscard]] matrix<4, 4, S> to_matrix() const {
    matrix<4, 4, S> m = identity<matrix<4, 4, S>>();
    set_block(m, 0, 0, scale_ * rotation_matrix());
    set_block(m, 0, 3, t_);
    return m;
  }
  /// `exp(adjoint() * xi) == T exp(xi) T^-1`.
  [[nodiscard]] matrix<7, 7, S> adjoint() const {
    const matrix<3, 3, S> r = rotation_matrix();
    matrix<7, 7, S> ad = zeros<matrix<7, 7, S>>();
    set_block(ad, 0, 0, scale_ * r);
    set_block(ad, 0, 3, hat<S>(t_) * r);
    set_block(ad, 0, 6, -t_);
    set_block(ad, 3, 3, r);
    ad(6, 6) = S(1);
    return ad;
  }
  /// `exp(xi + delta) ~ exp(left_jacobian(xi) * delta) * exp(xi)`.
  [[nodiscard]] static matrix<7, 7, S> left_jacobian(const tangent& xi) {
    const matrix<3, 3, S> k = hat<S>(segment<3>(xi, 3));
    matrix<7, 7, S> ad = zeros<matrix<7, 7, S>>();  // ad * eta is the Lie bracket of xi and eta
    set_block(ad, 0, 0, k + xi[6] * identity<matrix<3, 3, S>>());
    set_block(ad, 0, 3, hat<S>(head<3>(xi)));
    set_block(ad, 0, 6, -head<3>(xi));
    set_block(ad, 3, 3, k);
    return detail::exponential_integral<7, S>(ad);
  }
  [[nodiscard]] static matrix<7, 7, S> left_jacobian_inverse(const tangent& xi) {
    return orbis::inverse(left_jacobian(xi));
  }
  /// `exp(xi + delta) ~ exp(xi) * exp(right_jacobian(xi) * delta)`.
  [[nodiscard]] static matrix<7, 7, S> right_jacobian(const tangent& xi) { return left_jacobian(-xi); }
  [[nodiscard]] static matrix<7, 7, S> right_jacobian_inverse(const tangent& xi) { return left_jacobian_inverse(-xi); }

 private:
  /// The matrix that maps `rho` to the translation of `exp`.
  [[nodiscard]] static matrix<3, 3, S> translation_integral(const point& phi, S sigma) {
    return detail::exponential_integral<3, S>(hat<S>(phi) + sigma * identity<matrix<3, 3, S>>());
  }

  basic_so3<S> r_;
  point t_;
  S scale_ = S(1);
};

using sim3 = basic_sim3<double>;

}  // namespace orbis

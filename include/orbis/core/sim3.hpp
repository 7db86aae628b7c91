// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Similarity transforms in three dimensions: the Lie group Sim(3).
///
/// Formulas: H. Strasdat, "Local accuracy and global consistency for efficient visual SLAM", PhD
/// thesis, Imperial College London, 2012, chapter 2; the integrals are taken by Taylor series and
/// doubling (N. J. Higham, "Functions of Matrices", 2008, section 10.7.4), which has no special
/// cases where angle or log scale vanish.
#pragma once

#include <cassert>
#include <cmath>
#include <limits>

#include <Eigen/LU>

#include <orbis/core/se3.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>

namespace orbis {

namespace detail {

/// The sum of `a^n / (n + 1)!`, that is the integral of `exp(t a)` for `t` from 0 to 1.
template <int N>
[[nodiscard]] matrix<N, N> exponential_integral(const matrix<N, N>& a) {
  using square = matrix<N, N>;
  const double norm = a.cwiseAbs().colwise().sum().maxCoeff();
  if (!std::isfinite(norm)) return square::Constant(std::numeric_limits<double>::quiet_NaN());
  int doublings = 0;
  for (double n = norm; n > 0.5; n /= 2.0) ++doublings;

  square x = a * std::ldexp(1.0, -doublings);
  square sum = square::Identity();
  square term = square::Identity();
  for (int n = 2; n != 16; ++n) {  // 0.5^15 / 16! is below the rounding of double
    term = (term * x / static_cast<double>(n)).eval();
    sum += term;
  }
  for (; doublings != 0; --doublings) {  // F(2x) = F(x) (exp(x) + 1) / 2, exp(x) = 1 + x F(x)
    sum = (sum + 0.5 * (sum * x * sum)).eval();
    x *= 2.0;
  }
  return sum;
}

}  // namespace detail

/// Scaling, rotation, translation: `S_a_b * p_b == scale * (R * p_b) + t == p_a`. Tangent vectors
/// are `(rho, phi, sigma)`: translation, rotation (radians), logarithm of the scale.
class sim3 {
 public:
  using scalar = double;
  static constexpr int dof = 7;
  using tangent = vec7;
  using point = vec3;

  /// The identity.
  sim3() : t_{point::Zero()} {}
  /// @pre scale > 0
  sim3(const so3& rotation, const point& translation, double scale) : r_{rotation}, t_{translation}, scale_{scale} {
    assert(!(scale < 0.0));
  }
  /// The rigid transform, of scale 1.
  explicit sim3(const se3& rigid) : sim3(rigid.rotation(), rigid.translation(), 1.0) {}

  [[nodiscard]] static sim3 exp(const tangent& xi) {
    const point phi = xi.segment<3>(3);
    return {so3::exp(phi), translation_integral(phi, xi[6]) * xi.head<3>(), std::exp(xi[6])};
  }
  [[nodiscard]] tangent log() const {
    const point phi = r_.log();
    const double sigma = std::log(scale_);
    tangent xi;
    xi << translation_integral(phi, sigma).inverse() * t_, phi, sigma;
    return xi;
  }
  [[nodiscard]] sim3 inverse() const {
    const so3 r = r_.inverse();
    return {r, -(r * t_) / scale_, 1.0 / scale_};
  }
  [[nodiscard]] friend sim3 operator*(const sim3& a, const sim3& b) {
    return {a.r_ * b.r_, a * b.t_, a.scale_ * b.scale_};
  }
  [[nodiscard]] friend point operator*(const sim3& s, const point& p) { return s.scale_ * (s.r_ * p) + s.t_; }

  [[nodiscard]] const so3& rotation() const { return r_; }
  [[nodiscard]] const point& translation() const { return t_; }
  [[nodiscard]] double scale() const { return scale_; }
  [[nodiscard]] mat3 rotation_matrix() const { return r_.rotation_matrix(); }
  /// The homogeneous 4x4 matrix.
  [[nodiscard]] mat4 to_matrix() const {
    mat4 m = mat4::Identity();
    m.topLeftCorner<3, 3>() = scale_ * rotation_matrix();
    m.topRightCorner<3, 1>() = t_;
    return m;
  }
  /// `exp(adjoint() * xi) == T exp(xi) T^-1`.
  [[nodiscard]] mat7 adjoint() const {
    const mat3 r = rotation_matrix();
    mat7 ad = mat7::Zero();
    ad.block<3, 3>(0, 0) = scale_ * r;
    ad.block<3, 3>(0, 3) = hat<double>(t_) * r;
    ad.block<3, 1>(0, 6) = -t_;
    ad.block<3, 3>(3, 3) = r;
    ad(6, 6) = 1.0;
    return ad;
  }
  /// `exp(xi + delta) ~ exp(left_jacobian(xi) * delta) * exp(xi)`.
  [[nodiscard]] static mat7 left_jacobian(const tangent& xi) {
    const mat3 k = hat<double>(xi.segment<3>(3));
    mat7 ad = mat7::Zero();  // ad * eta is the Lie bracket of xi and eta
    ad.block<3, 3>(0, 0) = k + xi[6] * mat3::Identity();
    ad.block<3, 3>(0, 3) = hat<double>(xi.head<3>());
    ad.block<3, 1>(0, 6) = -xi.head<3>();
    ad.block<3, 3>(3, 3) = k;
    return detail::exponential_integral<7>(ad);
  }
  [[nodiscard]] static mat7 left_jacobian_inverse(const tangent& xi) {
    return left_jacobian(xi).partialPivLu().inverse();
  }
  /// `exp(xi + delta) ~ exp(xi) * exp(right_jacobian(xi) * delta)`.
  [[nodiscard]] static mat7 right_jacobian(const tangent& xi) { return left_jacobian(-xi); }
  [[nodiscard]] static mat7 right_jacobian_inverse(const tangent& xi) { return left_jacobian_inverse(-xi); }

 private:
  /// What takes `rho` to the translation of `exp`.
  [[nodiscard]] static mat3 translation_integral(const point& phi, double sigma) {
    return detail::exponential_integral<3>(hat<double>(phi) + sigma * mat3::Identity());
  }

  so3 r_;
  point t_;
  double scale_ = 1.0;
};

}  // namespace orbis

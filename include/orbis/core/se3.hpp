// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Rigid transforms in three dimensions: the Lie group SE(3).
///
/// Formulas: T. D. Barfoot, "State Estimation for Robotics", chapter 7.
#pragma once

#include <cmath>
#include <concepts>

#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>

namespace orbis {

/// A rigid transform. `T_a_b * p_b == p_a`: the pose of frame b in frame a. Tangent vectors are `(rho, phi)`:
/// translation (metres) first, then rotation (radians).
template <std::floating_point S = double>
class basic_se3 {
 public:
  using scalar = S;
  static constexpr int dof = 6;
  using tangent = matrix<6, 1, S>;
  using point = matrix<3, 1, S>;

  basic_se3() : t_{zeros<point>()} {}
  basic_se3(const basic_so3<S>& rotation, const point& translation) : r_{rotation}, t_{translation} {}

  [[nodiscard]] static basic_se3 exp(const tangent& xi) {
    const point rho(xi[0], xi[1], xi[2]), phi(xi[3], xi[4], xi[5]);
    return {basic_so3<S>::exp(phi), basic_so3<S>::left_jacobian(phi) * rho};
  }
  [[nodiscard]] tangent log() const {
    const point phi = r_.log(), rho = basic_so3<S>::left_jacobian_inverse(phi) * t_;
    tangent xi;
    for (int i = 0; i != 3; ++i) {
      xi[i] = rho[i];
      xi[3 + i] = phi[i];
    }
    return xi;
  }
  [[nodiscard]] basic_se3 inverse() const {
    const basic_so3<S> r = r_.inverse();
    return {r, -(r * t_)};
  }
  [[nodiscard]] friend basic_se3 operator*(const basic_se3& a, const basic_se3& b) {
    return {a.r_ * b.r_, a.r_ * b.t_ + a.t_};
  }
  [[nodiscard]] friend point operator*(const basic_se3& t, const point& p) { return t.r_ * p + t.t_; }

  [[nodiscard]] const basic_so3<S>& rotation() const { return r_; }
  [[nodiscard]] const point& translation() const { return t_; }
  [[nodiscard]] matrix<3, 3, S> rotation_matrix() const { return r_.rotation_matrix(); }
  /// The homogeneous 4x4 matrix.
  [[nodiscard]] matrix<4, 4, S> to_matrix() const {
    const matrix<3, 3, S> r = rotation_matrix();
    matrix<4, 4, S> m;
    for (int i = 0; i != 3; ++i) {
      for (int k = 0; k != 3; ++k) m(i, k) = r(i, k);
      m(i, 3) = t_[i];
      m(3, i) = S(0);
    }
    m(3, 3) = S(1);
    return m;
  }
  /// `exp(adjoint() * xi) == T exp(xi) T^-1`.
  [[nodiscard]] matrix<6, 6, S> adjoint() const {
    const matrix<3, 3, S> r = rotation_matrix();
    matrix<6, 6, S> ad = zeros<matrix<6, 6, S>>();
    set_block(ad, 0, 0, r);
    set_block(ad, 0, 3, hat<S>(t_) * r);
    set_block(ad, 3, 3, r);
    return ad;
  }
  template <std::floating_point T>
  [[nodiscard]] basic_se3<T> cast() const {
    return {r_.template cast<T>(), converted<T>(t_)};
  }

  /// `exp(xi + delta) ~ exp(left_jacobian(xi) * delta) * exp(xi)`.
  [[nodiscard]] static matrix<6, 6, S> left_jacobian(const tangent& xi) {
    const matrix<3, 3, S> j = basic_so3<S>::left_jacobian(tail<3>(xi));
    return block_triangular(j, q_matrix(xi));
  }
  [[nodiscard]] static matrix<6, 6, S> left_jacobian_inverse(const tangent& xi) {
    const matrix<3, 3, S> j = basic_so3<S>::left_jacobian_inverse(tail<3>(xi));
    return block_triangular(j, -(j * q_matrix(xi) * j));
  }
  /// `exp(xi + delta) ~ exp(xi) * exp(right_jacobian(xi) * delta)`.
  [[nodiscard]] static matrix<6, 6, S> right_jacobian(const tangent& xi) { return left_jacobian(-xi); }
  [[nodiscard]] static matrix<6, 6, S> right_jacobian_inverse(const tangent& xi) { return left_jacobian_inverse(-xi); }

 private:
  [[nodiscard]] static matrix<6, 6, S> block_triangular(const matrix<3, 3, S>& diagonal,
                                                        const matrix<3, 3, S>& corner) {
    matrix<6, 6, S> m = zeros<matrix<6, 6, S>>();
    set_block(m, 0, 0, diagonal);
    set_block(m, 0, 3, corner);
    set_block(m, 3, 3, diagonal);
    return m;
  }

  /// Coupling between translation and rotation in the left Jacobian: Barfoot's Q_l, equation 7.86.
  [[nodiscard]] static matrix<3, 3, S> q_matrix(const tangent& xi) {
    const matrix<3, 3, S> p = hat<S>(head<3>(xi));
    const matrix<3, 3, S> k = hat<S>(tail<3>(xi));
    const S t2 = squared_norm(tail<3>(xi));
    // (t - sin t) / t^3, (t^2 + 2 cos t - 2) / (2 t^4), (2 t - 3 sin t + t cos t) / (2 t^5)
    S a = S(0), b = S(0), c = S(0);
    if (t2 < S(1)) {  // the closed forms lose accuracy by cancellation
      S term = S(1) / S(6);
      for (int n = 0; n != 10; ++n) {  // term = (-t^2)^n / (2 n + 3)!
        a += term;
        b += term / S(2 * n + 4);
        c += term * S(n + 1) / S((2 * n + 4) * (2 * n + 5));
        term *= -t2 / S((2 * n + 4) * (2 * n + 5));
      }
    } else {
      const S t = std::sqrt(t2);
      a = (t - std::sin(t)) / (t2 * t);
      b = (t2 + S(2) * std::cos(t) - S(2)) / (S(2) * t2 * t2);
      c = (S(2) * t - S(3) * std::sin(t) + t * std::cos(t)) / (S(2) * t2 * t2 * t);
    }
    const matrix<3, 3, S> kp = k * p, pk = p * k, kpk = kp * k;
    return S(0.5) * p + a * (kp + pk + kpk) + b * (k * kp + pk * k - S(3) * kpk) + c * (kpk * k + k * kpk);
  }

  basic_so3<S> r_;
  point t_;
};

using se3 = basic_se3<double>;

}  // namespace orbis

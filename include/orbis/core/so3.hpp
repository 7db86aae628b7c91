// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Rotations in three dimensions: the Lie group SO(3).
///
/// Formulas: T. D. Barfoot, "State Estimation for Robotics", chapter 7; J. Sola, J. Deray,
/// D. Atchuthan, "A micro Lie theory for state estimation in robotics", arXiv:1812.01537.
#pragma once

#include <cmath>
#include <concepts>

#include <Eigen/Geometry>

#include <orbis/core/types.hpp>

namespace orbis {

/// The skew-symmetric matrix with `hat(a) * b == a.cross(b)`.
template <class S>
[[nodiscard]] matrix<3, 3, S> hat(const matrix<3, 1, S>& v) {
  matrix<3, 3, S> m;
  m(0, 0) = m(1, 1) = m(2, 2) = S(0);
  m(0, 1) = -v.z(), m(0, 2) = v.y(), m(1, 2) = -v.x();
  m(1, 0) = v.z(), m(2, 0) = -v.y(), m(2, 1) = v.x();
  return m;
}

/// A rotation, stored as a unit quaternion. Tangent vectors are rotation vectors (axis times angle, radians). `R_a_b *
/// p_b == p_a`.
template <std::floating_point S = double>
class basic_so3 {
 public:
  using scalar = S;
  static constexpr int dof = 3;
  using tangent = matrix<3, 1, S>;
  using point = matrix<3, 1, S>;
  using quaternion = Eigen::Quaternion<S, Eigen::DontAlign>;

  /// The identity.
  basic_so3() : q_{S(1), S(0), S(0), S(0)} {}
  /// Constructs a rotation from a quaternion of any positive norm, which is normalised.
  explicit basic_so3(const Eigen::Quaternion<S>& q) : q_{unit(q.x(), q.y(), q.z(), q.w())} {}
  explicit basic_so3(const quaternion& q) : q_{unit(q.x(), q.y(), q.z(), q.w())} {}
  /// Constructs a rotation from a quaternion of unit norm (up to rounding), stored unchanged: the exact inverse of
  /// `unit_quaternion()`.
  [[nodiscard]] static basic_so3 from_unit_quaternion(const quaternion& q) {
    basic_so3 r;
    r.q_ = q;
    return r;
  }
  /// Constructs a rotation from a matrix that is a rotation up to rounding. For larger errors, use `nearest_rotation`.
  explicit basic_so3(const matrix<3, 3, S>& r) : basic_so3(to_quaternion(r)) {}

  /// The rotation by `|phi|` radians about `phi`.
  [[nodiscard]] static basic_so3 exp(const tangent& phi) {
    const S theta2 = sum_of_squares(phi.x(), phi.y(), phi.z());
    S real, factor;  // cos(theta / 2), sin(theta / 2) / theta
    if (theta2 < small) {
      real = S(1) - theta2 / S(8);
      factor = S(0.5) - theta2 / S(48);
    } else {
      const S theta = std::sqrt(theta2);
      real = std::cos(theta / S(2));
      factor = std::sin(theta / S(2)) / theta;
    }
    return basic_so3(quaternion(real, factor * phi.x(), factor * phi.y(), factor * phi.z()));
  }

  /// The rotation vector, of norm at most pi.
  [[nodiscard]] tangent log() const {
    const S n2 = sum_of_squares(q_.x(), q_.y(), q_.z());
    const S w = q_.w();
    S factor;
    if (n2 < small) {
      factor = S(2) / w - S(2) * n2 / (S(3) * w * w * w);
    } else {
      const S n = std::sqrt(n2);
      // atan2 with both signs flipped for w < 0 selects the shorter rotation.
      factor = S(2) * (w < S(0) ? std::atan2(-n, -w) : std::atan2(n, w)) / n;
    }
    return {factor * q_.x(), factor * q_.y(), factor * q_.z()};
  }

  [[nodiscard]] basic_so3 inverse() const {
    basic_so3 r;
    r.q_ = quaternion(q_.w(), -q_.x(), -q_.y(), -q_.z());
    return r;
  }
  [[nodiscard]] friend basic_so3 operator*(const basic_so3& a, const basic_so3& b) {
    const quaternion &p = a.q_, &q = b.q_;
    // Pairwise sums have smaller rounding errors than sequential ones.
    return basic_so3(quaternion((p.w() * q.w() - p.x() * q.x()) - (p.y() * q.y() + p.z() * q.z()),
                                (p.w() * q.x() + p.x() * q.w()) + (p.y() * q.z() - p.z() * q.y()),
                                (p.w() * q.y() + p.y() * q.w()) + (p.z() * q.x() - p.x() * q.z()),
                                (p.w() * q.z() + p.z() * q.w()) + (p.x() * q.y() - p.y() * q.x())));
  }
  [[nodiscard]] friend point operator*(const basic_so3& r, const point& p) {
    const point v(r.q_.x(), r.q_.y(), r.q_.z());
    point twice = cross(v, p);
    twice += twice;
    return p + r.q_.w() * twice + cross(v, twice);
  }

  [[nodiscard]] const quaternion& unit_quaternion() const { return q_; }
  [[nodiscard]] matrix<3, 3, S> rotation_matrix() const {
    const S tx = S(2) * q_.x(), ty = S(2) * q_.y(), tz = S(2) * q_.z();
    const S twx = tx * q_.w(), twy = ty * q_.w(), twz = tz * q_.w();
    const S txx = tx * q_.x(), txy = ty * q_.x(), txz = tz * q_.x();
    const S tyy = ty * q_.y(), tyz = tz * q_.y(), tzz = tz * q_.z();
    matrix<3, 3, S> m;
    m(0, 0) = S(1) - (tyy + tzz), m(0, 1) = txy - twz, m(0, 2) = txz + twy;
    m(1, 0) = txy + twz, m(1, 1) = S(1) - (txx + tzz), m(1, 2) = tyz - twx;
    m(2, 0) = txz - twy, m(2, 1) = tyz + twx, m(2, 2) = S(1) - (txx + tyy);
    return m;
  }
  /// `exp(adjoint() * phi) == R exp(phi) R^-1`.
  [[nodiscard]] matrix<3, 3, S> adjoint() const { return rotation_matrix(); }
  /// The angle in radians, in [0, pi].
  [[nodiscard]] S angle() const { return norm(log()); }
  template <std::floating_point T>
  [[nodiscard]] basic_so3<T> cast() const {
    return basic_so3<T>(typename basic_so3<T>::quaternion(static_cast<T>(q_.w()), static_cast<T>(q_.x()),
                                                          static_cast<T>(q_.y()), static_cast<T>(q_.z())));
  }

  /// `exp(phi + delta) ~ exp(left_jacobian(phi) * delta) * exp(phi)`.
  [[nodiscard]] static matrix<3, 3, S> left_jacobian(const tangent& phi) {
    const S theta2 = sum_of_squares(phi.x(), phi.y(), phi.z());
    S a, b;  // (1 - cos t) / t^2, (t - sin t) / t^3
    if (theta2 < small) {
      a = S(0.5) - theta2 / S(24);
      b = S(1) / S(6) - theta2 / S(120);
    } else {
      const S theta = std::sqrt(theta2);
      const S half = std::sin(theta / S(2)) / theta;
      a = S(2) * half * half;
      b = (theta - std::sin(theta)) / (theta2 * theta);
    }
    return polynomial_of_hat(phi, a, b);
  }
  [[nodiscard]] static matrix<3, 3, S> left_jacobian_inverse(const tangent& phi) {
    const S theta2 = sum_of_squares(phi.x(), phi.y(), phi.z());
    S c;  // 1 / t^2 - (1 + cos t) / (2 t sin t)
    if (theta2 < small) {
      c = S(1) / S(12) + theta2 / S(720);
    } else {
      const S half = std::sqrt(theta2) / S(2);
      c = (S(1) - half * std::cos(half) / std::sin(half)) / theta2;
    }
    return polynomial_of_hat(phi, S(-0.5), c);
  }
  /// `exp(phi + delta) ~ exp(phi) * exp(right_jacobian(phi) * delta)`.
  [[nodiscard]] static matrix<3, 3, S> right_jacobian(const tangent& phi) { return left_jacobian(-phi); }
  [[nodiscard]] static matrix<3, 3, S> right_jacobian_inverse(const tangent& phi) {
    return left_jacobian_inverse(-phi);
  }

 private:
  /// Squared angle below which the series is accurate to rounding.
  static constexpr S small = std::same_as<S, float> ? S(1e-4) : S(1e-8);

  // Written out because expression templates would slow down the compilation of every file that includes this header.
  [[nodiscard]] static S sum_of_squares(S x, S y, S z) { return x * x + y * y + z * z; }
  [[nodiscard]] static quaternion unit(S x, S y, S z, S w) {
    const S square = (x * x + z * z) + (y * y + w * w);
    if (!(square > S(0))) return quaternion(w, x, y, z);
    const S norm = std::sqrt(square);
    return quaternion(w / norm, x / norm, y / norm, z / norm);
  }
  /// Source: K. Shoemake, "Animating rotation with quaternion curves", SIGGRAPH 1985, appendix I.
  [[nodiscard]] static quaternion to_quaternion(const matrix<3, 3, S>& m) {
    const S trace = m(0, 0) + (m(1, 1) + m(2, 2));
    if (trace > S(0)) {
      const S root = std::sqrt(trace + S(1)), scale = S(0.5) / root;
      return quaternion(S(0.5) * root, (m(2, 1) - m(1, 2)) * scale, (m(0, 2) - m(2, 0)) * scale,
                        (m(1, 0) - m(0, 1)) * scale);
    }
    int i = m(1, 1) > m(0, 0) ? 1 : 0;
    if (m(2, 2) > m(i, i)) i = 2;
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const S root = std::sqrt(m(i, i) - m(j, j) - m(k, k) + S(1)), scale = S(0.5) / root;
    S v[3];
    v[i] = S(0.5) * root;
    v[j] = (m(j, i) + m(i, j)) * scale;
    v[k] = (m(k, i) + m(i, k)) * scale;
    return quaternion((m(k, j) - m(j, k)) * scale, v[0], v[1], v[2]);
  }
  /// `I + a hat(phi) + b hat(phi)^2`.
  [[nodiscard]] static matrix<3, 3, S> polynomial_of_hat(const tangent& phi, S a, S b) {
    const S x = phi.x(), y = phi.y(), z = phi.z();
    const S ax = a * x, ay = a * y, az = a * z, bx = b * x, by = b * y, bz = b * z;
    matrix<3, 3, S> m;
    m(0, 0) = S(1) - (bz * z + by * y);
    m(1, 1) = S(1) - (bz * z + bx * x);
    m(2, 2) = S(1) - (by * y + bx * x);
    m(0, 1) = by * x - az, m(1, 0) = bx * y + az;
    m(0, 2) = bz * x + ay, m(2, 0) = bx * z - ay;
    m(1, 2) = bz * y - ax, m(2, 1) = by * z + ax;
    return m;
  }
  quaternion q_;
};

using so3 = basic_so3<double>;

}  // namespace orbis

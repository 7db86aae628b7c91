// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Rigid transforms in three dimensions: the Lie group SE(3).
///
/// Formulas: T. D. Barfoot, "State Estimation for Robotics", chapter 7.
#pragma once

#include <concepts>

#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>

namespace orbis {

/// A rigid transform. `T_a_b * p_b == p_a`: the pose of frame b in frame a. Tangent vectors are
/// `(rho, phi)`, translation (metres) first, then rotation (radians).
template <std::floating_point S = double>
class basic_se3 {
 public:
  using scalar = S;
  static constexpr int dof = 6;
  using tangent = matrix<6, 1, S>;
  using point = matrix<3, 1, S>;

  basic_se3() : t_{point::Zero()} {}
  basic_se3(const basic_so3<S>& rotation, const point& translation) : r_{rotation}, t_{translation} {}

  [[nodiscard]] static basic_se3 exp(const tangent& xi) {
    const point rho = xi.template head<3>();
    const point phi = xi.template tail<3>();
    return {basic_so3<S>::exp(phi), basic_so3<S>::left_jacobian(phi) * rho};
  }
  [[nodiscard]] tangent log() const {
    const point phi = r_.log();
    tangent xi;
    xi << basic_so3<S>::left_jacobian_inverse(phi) * t_, phi;
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
    matrix<4, 4, S> m = matrix<4, 4, S>::Identity();
    m.template topLeftCorner<3, 3>() = rotation_matrix();
    m.template topRightCorner<3, 1>() = t_;
    return m;
  }
  /// `exp(adjoint() * xi) == T exp(xi) T^-1`.
  [[nodiscard]] matrix<6, 6, S> adjoint() const {
    const matrix<3, 3, S> r = rotation_matrix();
    matrix<6, 6, S> ad = matrix<6, 6, S>::Zero();
    ad.template topLeftCorner<3, 3>() = r;
    ad.template topRightCorner<3, 3>() = hat<S>(t_) * r;
    ad.template bottomRightCorner<3, 3>() = r;
    return ad;
  }
  template <std::floating_point T>
  [[nodiscard]] basic_se3<T> cast() const {
    return {r_.template cast<T>(), t_.template cast<T>()};
  }

 private:
  basic_so3<S> r_;
  point t_;
};

using se3 = basic_se3<double>;
using se3f = basic_se3<float>;

}  // namespace orbis

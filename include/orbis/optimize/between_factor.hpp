// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a measured relative pose says about two poses.
///
/// With `T_a_b` measured and `D = T_a_b^-1 * (T_world_a^-1 * T_world_b)`, which is the identity where
/// all agree, the residual is a vector made of `D`. Its Jacobians are for steps on the right of the
/// poses, `T * exp(d)`.
#pragma once

#include <concepts>

#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>

namespace orbis::optimize {

/// A residual of two poses `T` and a measured one between them. `linearize` fills in the derivatives
/// by a step of each pose and returns the residual.
template <class F, class T>
concept between_factor = std::copyable<F> &&
    requires(const F& f, const T& pose, matrix<F::dimension, T::dof>& jacobian) {
  { f.residual(pose, pose, pose) } -> std::same_as<matrix<F::dimension>>;
  { f.linearize(pose, pose, pose, jacobian, jacobian) } -> std::same_as<matrix<F::dimension>>;
};

/// The logarithm of `D`, for any Lie group: (rho, phi), for Sim(3) with the logarithm of the scale.
template <class T>
struct logarithm_between {
  static constexpr int dimension = T::dof;
  using vector = matrix<dimension>;
  using jacobian = matrix<dimension, dimension>;

  [[nodiscard]] static vector residual(const T& T_world_a, const T& T_world_b, const T& T_a_b) {
    return (T_a_b.inverse() * (T_world_a.inverse() * T_world_b)).log();
  }
  [[nodiscard]] static vector linearize(const T& T_world_a, const T& T_world_b, const T& T_a_b, jacobian& by_a,
                                        jacobian& by_b) {
    const T between = T_world_a.inverse() * T_world_b;
    const vector r = (T_a_b.inverse() * between).log();
    by_b = T::right_jacobian_inverse(r);
    by_a = -by_b * between.inverse().adjoint();
    return r;
  }
};

/// The translation of `D` and the vector part of its quaternion with positive real part: the residual
/// that g2o's `EDGE_SE3:QUAT` means, so that information matrices and chi2 values have the same
/// meaning. Cheaper than the logarithm; for small angles the rotational part is half of its.
///
/// Source: R. Kuemmerle, G. Grisetti, H. Strasdat, K. Konolige, W. Burgard, "g2o: a general framework for
/// graph optimization", ICRA 2011.
struct quaternion_between {
  static constexpr int dimension = 6;

  [[nodiscard]] static vec6 residual(const se3& T_world_a, const se3& T_world_b, const se3& T_a_b) {
    return residual_of(T_a_b.inverse() * (T_world_a.inverse() * T_world_b));
  }
  [[nodiscard]] static vec6 linearize(const se3& T_world_a, const se3& T_world_b, const se3& T_a_b, mat6& by_a,
                                      mat6& by_b) {
    const se3 between = T_world_a.inverse() * T_world_b;
    const se3 inverse = T_a_b.inverse();
    const se3 d = inverse * between;
    const auto& q = d.rotation().unit_quaternion();
    const double half = q.w() < 0.0 ? -0.5 : 0.5, real = half * q.w();
    const mat3 cross = hat<double>(vec3(half * q.x(), half * q.y(), half * q.z()));
    const mat3 back = inverse.rotation_matrix(), turn = d.rotation_matrix();
    const mat3 lever = back * hat<double>(between.translation()), by_turn = cross * back;
    for (int k = 0; k != 3; ++k)
      for (int i = 0; i != 3; ++i) {
        by_b(i, k) = turn(i, k);
        by_b(i, 3 + k) = 0.0;
        by_b(3 + i, k) = 0.0;
        by_b(3 + i, 3 + k) = (i == k ? real : 0.0) + cross(i, k);
        by_a(i, k) = -back(i, k);
        by_a(i, 3 + k) = lever(i, k);
        by_a(3 + i, k) = 0.0;
        by_a(3 + i, 3 + k) = by_turn(i, k) - real * back(i, k);
      }
    return residual_of(d);
  }

 private:
  [[nodiscard]] static vec6 residual_of(const se3& d) {
    const auto& q = d.rotation().unit_quaternion();
    const vec3& t = d.translation();
    const double sign = q.w() < 0.0 ? -1.0 : 1.0;
    vec6 r;
    r[0] = t.x(), r[1] = t.y(), r[2] = t.z();
    r[3] = sign * q.x(), r[4] = sign * q.y(), r[5] = sign * q.z();
    return r;
  }
};

static_assert(between_factor<quaternion_between, se3> && between_factor<logarithm_between<se3>, se3> &&
              between_factor<logarithm_between<sim3>, sim3> && between_factor<logarithm_between<so3>, so3>);

}  // namespace orbis::optimize

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The camera pose from any number of known points and the rays under which they are seen, in closed form but for a
/// few steps of Newton's method: no start is needed, points in a plane are welcome, no match may be wrong.
///
/// Given the rotation the best translation is known, and the sum of squared distances between points and rays is a
/// quadratic form in the nine entries of the rotation. Its minima among rotations are looked for from the rotations
/// nearest to the form's eigenvectors.
///
/// Source: G. Terzakis, M. Lourakis, "A consistently fast and globally optimal solution to the Perspective-n-Point
/// problem", ECCV 2020; here the descent is Newton's on SO(3) instead of sequential quadratic programming, and all
/// eigenvectors are tried.
///
/// `S` is always double: the functions are templates so that only who calls them has them compiled.
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <span>
#include <string>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <orbis/core/jacobi.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/optimize/detail/sparse/small_cholesky.hpp>

namespace orbis::optimize {

namespace detail {

/// Goes down `r^T omega r` over rotations, r being the entries column by column; returns the cost.
template <std::same_as<double> S = double>
[[nodiscard]] double descend_on_rotations(const matrix<9, 9, S>& omega, matrix<3, 3, S>& rotation) {
  using vec3 = matrix<3, 1, S>;
  using mat3 = matrix<3, 3, S>;
  using vec9 = matrix<9, 1, S>;
  const auto weigh = [&](const mat3& at) { return vec9(omega * Eigen::Map<const vec9>(at.data())); };
  vec9 w = weigh(rotation);
  double cost = w.dot(Eigen::Map<const vec9>(rotation.data()));
  for (int step = 0; step != 30; ++step) {
    // With rotation * exp(d): first and second derivatives by d.
    const mat3 b = rotation.transpose() * Eigen::Map<const mat3>(w.data());
    const vec3 gradient(b(2, 1) - b(1, 2), b(0, 2) - b(2, 0), b(1, 0) - b(0, 1));
    matrix<9, 3, S> by_d;
    for (int k = 0; k != 3; ++k) {
      const mat3 d = rotation * hat<double>(vec3(vec3::Unit(k)));
      by_d.col(k) = Eigen::Map<const vec9>(d.data());
    }
    const matrix<9, 3, S> omega_by_d = omega.lazyProduct(by_d);
    mat3 hessian = by_d.transpose().lazyProduct(omega_by_d) + 0.5 * (b + b.transpose());
    hessian.diagonal().array() -= b.trace();
    const vec3 values = Eigen::SelfAdjointEigenSolver<mat3>(hessian, Eigen::EigenvaluesOnly).eigenvalues();
    double shift = values[0] > 1e-12 * values[2] ? 0.0 : 1e-3 * std::fabs(values[2]) - values[0];
    bool better = false;
    for (int attempt = 0; attempt != 8 && !better; ++attempt) {
      mat3 shifted = hessian;
      shifted.diagonal().array() += shift;
      small_cholesky<3> factors;
      if (!factors.set(shifted) || !(factors.factor(0.0) > 0.0)) return cost;
      vec3 d = -factors.solve(gradient);
      if (!d.allFinite()) return cost;
      if (d.norm() > 1.0) d /= d.norm();
      const mat3 next = (so3(rotation) * so3::exp(d)).rotation_matrix();
      const vec9 next_w = weigh(next);
      const double next_cost = next_w.dot(Eigen::Map<const vec9>(next.data()));
      if (next_cost < cost || (d.norm() < 1e-6 && shift == 0.0)) {  // the last digits are below the cost's rounding
        better = d.norm() > 1e-12;
        rotation = next;
        w = next_w;
        cost = next_cost;
        if (!better) return cost;
      }
      shift = std::max(4.0 * shift, 1e-2 * std::fabs(values[2]));
    }
    if (!better) break;
  }
  return cost;
}

}  // namespace detail

/// `T_world_camera` with the least sum of squared distances between `points_world[i]` (metres) and the lines along
/// `rays[i]` (camera frame, of any positive length). O(n). Where errors in pixels are to be least, refine the outcome.
/// Errors: `invalid_argument` for spans of different length, `no_data` below four points (three have several poses:
/// see `p3p`), `degenerate` where points or rays are not finite, points lie on a line or in one place, or rays all have
/// one direction; the message says which.
template <std::same_as<double> S = double>
[[nodiscard]] result<se3> pose_from_points(std::span<const vec3> points_world, std::span<const vec3> rays) {
  using vec3 = matrix<3, 1, S>;
  using mat3 = matrix<3, 3, S>;
  using vec9 = matrix<9, 1, S>;
  using mat9 = matrix<9, 9, S>;
  constexpr const char* where = "pose from points";
  const std::size_t n = points_world.size();
  if (n != rays.size()) return fail(errc::invalid_argument, where, "the lists of points and rays differ in length");
  if (n < 4) return fail(errc::no_data, where, "fewer than four points");
  vec3 centre = vec3::Zero();
  for (std::size_t i = 0; i != n; ++i) {
    if (!points_world[i].allFinite() || !rays[i].allFinite() || !(rays[i].squaredNorm() > 0.0))
      return fail(errc::degenerate, where, "point or ray " + std::to_string(i) + " is not finite or has no length");
    centre += points_world[i];
  }
  centre /= static_cast<double>(n);
  mat3 spread = mat3::Zero();
  for (std::size_t i = 0; i != n; ++i) {
    const vec3 d = points_world[i] - centre;
    spread += d * d.transpose();
  }
  const vec3 sizes = eigen_of_symmetric<3>(spread).values;
  if (!(sizes[1] > 1e-12 * sizes[2]) || !(sizes[2] > 1e-30 * static_cast<double>(n) * centre.squaredNorm()))
    return fail(errc::degenerate, where, "the points all lie on one line or in one place");
  const double size = std::sqrt(sizes[2] / static_cast<double>(n));

  // The cost is sum |Q_i (R x_i + t)|^2 with Q_i = I - v v^T, v the unit ray.
  mat9 omega = mat9::Zero();
  matrix<3, 9, S> mixed = matrix<3, 9, S>::Zero();
  mat3 across = mat3::Zero();
  for (std::size_t i = 0; i != n; ++i) {
    const vec3 x = (points_world[i] - centre) / size, v = vec3(rays[i]).normalized();
    const mat3 q = mat3::Identity() - v * v.transpose();
    across += q;
    for (int a = 0; a != 3; ++a) {
      mixed.template middleCols<3>(3 * a) += x[a] * q;
      for (int b = 0; b <= a; ++b) omega.template block<3, 3>(3 * a, 3 * b) += (x[a] * x[b]) * q;
    }
  }
  for (int i = 0; i != 9; ++i)  // the blocks themselves are symmetric
    for (int k = 0; k < 3 * (i / 3); ++k) omega(k, i) = omega(i, k);
  const vec3 determined = eigen_of_symmetric<3>(across).values;
  if (!(determined[0] > 1e-12 * determined[2])) return fail(errc::degenerate, where, "the rays all have one direction");
  small_cholesky<3> factors;
  if (!factors.set(across) || !(factors.factor(0.0) > 0.0))
    return fail(errc::degenerate, where, "the rays all have one direction");
  matrix<3, 9, S> to_translation;
  for (int k = 0; k != 9; ++k) to_translation.col(k) = -factors.solve(mixed.col(k));
  omega += mixed.transpose().lazyProduct(to_translation);
  omega = 0.5 * (omega + omega.transpose()).eval();

  const auto eigen = eigen_of_symmetric<9>(omega);
  double best = std::numeric_limits<double>::infinity();
  mat3 best_rotation = mat3::Identity();
  vec3 best_translation = vec3::Zero();
  for (int k = 0; k != 9; ++k)
    for (const double sign : {1.0, -1.0}) {
      const vec9 e = sign * eigen.vectors.col(k);
      const auto svd = singular_values_of<3>(mat3(Eigen::Map<const mat3>(e.data())));
      const vec3 flip(1.0, 1.0, svd.u.determinant() * svd.v.determinant());
      mat3 rotation = svd.u * flip.asDiagonal() * svd.v.transpose();
      const double cost = detail::descend_on_rotations<S>(omega, rotation);
      if (!(cost < best)) continue;
      const vec3 translation = to_translation * Eigen::Map<const vec9>(rotation.data());
      std::size_t in_front = 0;
      for (std::size_t i = 0; i != n; ++i)
        in_front += rays[i].dot(rotation * ((points_world[i] - centre) / size) + translation) > 0.0 ? 1U : 0U;
      if (2 * in_front <= n) continue;
      best = cost;
      best_rotation = rotation;
      best_translation = translation;
    }
  if (!std::isfinite(best)) return fail(errc::degenerate, where, "no pose has the points in front of the camera");
  const so3 R_camera_world(best_rotation);
  return se3(R_camera_world, vec3(size * best_translation - R_camera_world * centre)).inverse();
}

}  // namespace orbis::optimize

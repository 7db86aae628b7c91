// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Perspective three-point: the camera poses that see three known points along three known rays.
///
/// With unit rays `y_i` and depths along them `l_i`, the three distances between the points give
/// `l^T M_ij l = a_ij`. Two homogeneous combinations of these are conics through up to four common
/// points; the pencil they span holds a degenerate conic, a pair of lines, found from one real root
/// of a cubic. On each line one quadratic is left.
///
/// Source of the formulation: M. Persson, K. Nordberg, "Lambda Twist: an accurate fast robust
/// perspective three point (P3P) solver", ECCV 2018; the problem is Grunert's of 1841.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <orbis/core/se3.hpp>

namespace orbis::optimize {

/// Up to four poses `T_world_camera`.
class p3p_solutions {
 public:
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] const se3& operator[](std::size_t i) const noexcept { return poses_[i]; }
  [[nodiscard]] const se3* begin() const noexcept { return poses_.data(); }
  [[nodiscard]] const se3* end() const noexcept { return poses_.data() + size_; }
  void push_back(const se3& pose) noexcept {
    if (size_ < poses_.size()) poses_[size_++] = pose;
  }

 private:
  std::array<se3, 4> poses_;
  std::size_t size_ = 0;
};

namespace detail {

/// A real root of `c3 x^3 + c2 x^2 + c1 x + c0`, the best separated one where there are three.
/// @pre |c3| >= |c0|
[[nodiscard]] inline double real_root_of_cubic(double c3, double c2, double c1, double c0) {
  if (c3 == 0.0) return 0.0;  // then c0 is 0 as well
  const double a = c2 / c3, b = c1 / c3, c = c0 / c3;
  const double q = (a * a - 3.0 * b) / 9.0;
  const double r = (2.0 * a * a * a - 9.0 * a * b + 27.0 * c) / 54.0;
  double x;
  if (r * r < q * q * q) {  // three real roots: the outer one away from the other two
    const double pi = 3.14159265358979323846;
    const double theta = std::acos(std::fmin(1.0, std::fmax(-1.0, r / std::sqrt(q * q * q))));
    const double root_q = std::sqrt(q);
    x = -2.0 * root_q * (r < 0.0 ? std::cos((theta + 2.0 * pi) / 3.0) : std::cos(theta / 3.0)) - a / 3.0;
  } else {
    const double s = -std::copysign(std::cbrt(std::fabs(r) + std::sqrt(r * r - q * q * q)), r);
    x = s + (s != 0.0 ? q / s : 0.0) - a / 3.0;
  }
  for (int i = 0; i < 3; ++i) {
    const double slope = (3.0 * x + 2.0 * a) * x + b;
    if (slope == 0.0) break;
    const double step = (((x + a) * x + b) * x + c) / slope;
    x -= step;
    if (std::fabs(step) <= 1e-16 * std::fabs(x)) break;
  }
  return x;
}

/// Newton's method on the three distances; the root it starts from is already good.
inline void polish_depths(vec3& l, const std::array<double, 3>& cosines, const std::array<double, 3>& squared) {
  const auto [b12, b13, b23] = cosines;
  const auto [a12, a13, a23] = squared;
  for (int i = 0; i < 5; ++i) {
    const vec3 residual(l(0) * l(0) + l(1) * l(1) - 2.0 * b12 * l(0) * l(1) - a12,
                        l(0) * l(0) + l(2) * l(2) - 2.0 * b13 * l(0) * l(2) - a13,
                        l(1) * l(1) + l(2) * l(2) - 2.0 * b23 * l(1) * l(2) - a23);
    if (residual.lpNorm<1>() < 1e-15 * (a12 + a13 + a23)) return;
    mat3 j;
    j << l(0) - b12 * l(1), l(1) - b12 * l(0), 0.0,  //
        l(0) - b13 * l(2), 0.0, l(2) - b13 * l(0),   //
        0.0, l(1) - b23 * l(2), l(2) - b23 * l(1);
    const double determinant = j.determinant();
    if (std::fabs(determinant) < 1e-14 * l.squaredNorm() * l.norm()) return;  // a double root: as good as it gets
    l -= 0.5 * (j.inverse() * residual);
  }
}

/// A right-handed orthonormal frame from two sides of a triangle.
[[nodiscard]] inline mat3 triangle_frame(const vec3& side, const vec3& other) {
  mat3 f;
  f.col(0) = side.normalized();
  f.col(2) = side.cross(other).normalized();
  f.col(1) = f.col(2).cross(f.col(0));
  return f;
}

}  // namespace detail

/// All poses `T_world_camera` from which `points_world[i]` lies on the ray `rays[i]` (camera frame,
/// any positive length, in front of the camera along the ray). Empty where the points are collinear
/// or anything is not finite. Constant time, no allocation.
[[nodiscard]] inline p3p_solutions p3p(const std::array<vec3, 3>& points_world, const std::array<vec3, 3>& rays) {
  p3p_solutions solutions;
  const vec3 y1 = rays[0].normalized(), y2 = rays[1].normalized(), y3 = rays[2].normalized();
  const vec3 d12 = points_world[0] - points_world[1];
  const vec3 d13 = points_world[0] - points_world[2];
  const double a12 = d12.squaredNorm(), a13 = d13.squaredNorm();
  const double a23 = (points_world[1] - points_world[2]).squaredNorm();
  const double area = d12.cross(d13).norm();
  if (!(area > 1e-9 * (a12 + a13)) || !std::isfinite(area + y1.sum() + y2.sum() + y3.sum())) return solutions;
  const double b12 = y1.dot(y2), b13 = y1.dot(y3), b23 = y2.dot(y3);

  mat3 d1, d2;  // conics through the wanted depths
  d1 << a23, -a23 * b12, 0.0, -a23 * b12, a23 - a12, a12 * b23, 0.0, a12 * b23, -a12;
  d2 << a23, 0.0, -a23 * b13, 0.0, -a13, a13 * b23, -a23 * b13, a13 * b23, a23 - a13;
  d1 /= d1.norm();
  d2 /= d2.norm();
  if (std::fabs(d2.determinant()) < std::fabs(d1.determinant())) d1.swap(d2);

  // det(d1 + g d2) as a polynomial in g, by Jacobi's formula with the two adjugates.
  const auto adjugate = [](const mat3& m) {
    mat3 adj;
    adj.col(0) = m.row(1).cross(m.row(2)).transpose();
    adj.col(1) = m.row(2).cross(m.row(0)).transpose();
    adj.col(2) = m.row(0).cross(m.row(1)).transpose();
    return adj;
  };
  const double g = detail::real_root_of_cubic(d2.determinant(), (adjugate(d2) * d1).trace(),
                                              (adjugate(d1) * d2).trace(), d1.determinant());
  mat3 pair = d1 + g * d2;
  pair /= pair.norm();
  if (!pair.allFinite()) return solutions;
  const Eigen::SelfAdjointEigenSolver<mat3> eigen(pair);
  const vec3 values = eigen.eigenvalues();
  // Two lines through a common point: one eigenvalue of each sign, the middle one zero up to rounding.
  if (!(values(2) > 0.0) || !(values(0) < 0.0)) return solutions;
  const vec3 plus = std::sqrt(values(2)) * eigen.eigenvectors().col(2);
  const vec3 minus = std::sqrt(-values(0)) * eigen.eigenvectors().col(0);
  // On the lines d1 = -g d2; take the one that is not small there.
  const mat3& conic = std::fabs(g) <= 1.0 ? d2 : d1;

  const mat3 world = detail::triangle_frame(d12, d13);
  for (const double side : {1.0, -1.0}) {
    const vec3 normal = (plus + side * minus).normalized();
    const vec3 u = normal.unitOrthogonal();
    const vec3 v = normal.cross(u);
    // (cu u + cv v) on the conic: qa cu^2 + 2 qb cu cv + qc cv^2 = 0, in homogeneous coordinates.
    const double qa = u.dot(conic * u), qb = u.dot(conic * v), qc = v.dot(conic * v);
    const double discriminant = qb * qb - qa * qc;
    // Slightly negative is a double root, up to rounding.
    if (!(discriminant > -1e-10 * (qa * qa + qb * qb + qc * qc))) continue;
    const double root = -(qb + std::copysign(std::sqrt(std::fmax(0.0, discriminant)), qb));
    for (const vec3& direction : {vec3(root * u + qa * v), vec3(qc * u + root * v)}) {
      // direction = cu u + cv v with cu / cv = root / qa, or qc / root.
      vec3 l = direction.sum() > 0.0 ? direction : vec3(-direction);
      const double measured = l(0) * l(0) + l(1) * l(1) - 2.0 * b12 * l(0) * l(1) + l(0) * l(0) + l(2) * l(2) -
                              2.0 * b13 * l(0) * l(2) + l(1) * l(1) + l(2) * l(2) - 2.0 * b23 * l(1) * l(2);
      if (!(measured > 0.0)) continue;
      l *= std::sqrt((a12 + a13 + a23) / measured);
      if (!(l.minCoeff() > 0.0)) continue;
      detail::polish_depths(l, {b12, b13, b23}, {a12, a13, a23});
      if (!(l.minCoeff() > 0.0) || !l.allFinite()) continue;
      const vec3 c1 = l(0) * y1, c2 = l(1) * y2, c3 = l(2) * y3;
      const mat3 seen = detail::triangle_frame(c1 - c2, c1 - c3);
      const so3 rotation(mat3(world * seen.transpose()));
      const vec3 translation =
          (points_world[0] + points_world[1] + points_world[2]) / 3.0 - rotation * vec3((c1 + c2 + c3) / 3.0);
      if (translation.allFinite()) solutions.push_back(se3(rotation, translation));
    }
  }
  return solutions;
}

}  // namespace orbis::optimize

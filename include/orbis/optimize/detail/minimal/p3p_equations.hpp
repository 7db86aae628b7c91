// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The equations of the perspective three-point problem.
///
/// With unit rays `y_i` and depths `l_i` along them, the three distances between the points give `l^T M_ij l = a_ij`.
/// Two homogeneous combinations of these equations are conics with up to four common points. Their pencil contains a
/// degenerate conic, a pair of lines, given by a real root of a cubic. On each line, a quadratic equation remains.
/// Newton's method on the depths recovers the accuracy lost in these steps.
///
/// Sources: J. A. Grunert, 1841, for the problem; M. Persson, K. Nordberg, "Lambda Twist: an accurate fast robust
/// perspective three point (P3P) solver", ECCV 2018, for the conics; J. Richter-Gebert, "Perspectives on Projective
/// Geometry", 2011, section 11.1, for the decomposition of a degenerate conic into lines by its adjugate.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include <orbis/core/types.hpp>

namespace orbis::optimize::detail {

/// Returns a real root of `c3 x^3 + c2 x^2 + c1 x + c0`; if there are three, the outer root that is farther from the
/// middle one.
/// @pre |c3| >= |c0|
[[nodiscard]] inline double real_root_of_cubic(double c3, double c2, double c1, double c0) {
  if (c3 == 0.0) return 0.0;  // then c0 is also 0
  const double a = c2 / c3, b = c1 / c3, c = c0 / c3;
  const double q = (a * a - 3.0 * b) / 9.0;
  const double r = (2.0 * a * a * a - 9.0 * a * b + 27.0 * c) / 54.0;
  double x;
  if (r * r < q * q * q) {  // three real roots: take the outer root that is farther from the middle one
    const double root_q = std::sqrt(q);
    const double cosine = std::fmin(1.0, std::fabs(r) / (q * root_q));
    x = -2.0 * std::copysign(root_q, r) * std::cos(std::acos(cosine) / 3.0) - a / 3.0;
  } else {
    const double s = -std::copysign(std::cbrt(std::fabs(r) + std::sqrt(r * r - q * q * q)), r);
    x = s + (s != 0.0 ? q / s : 0.0) - a / 3.0;
  }
  for (int i = 0; i < 3; ++i) {
    const double slope = (3.0 * x + 2.0 * a) * x + b;
    if (slope == 0.0) break;
    const double step = (((x + a) * x + b) * x + c) / slope;
    x -= step;
    if (std::fabs(step) <= 1e-15 * std::fabs(x)) break;
  }
  return x;
}

/// A symmetric 3x3 matrix.
struct conic {
  double xx, xy, xz, yy, yz, zz;
  [[nodiscard]] conic adjugate() const noexcept {
    return {yy * zz - yz * yz, yz * xz - xy * zz, xy * yz - yy * xz,
            xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy};
  }
  [[nodiscard]] vec3 times(const vec3& v) const noexcept {
    return {xx * v.x() + xy * v.y() + xz * v.z(), xy * v.x() + yy * v.y() + yz * v.z(),
            xz * v.x() + yz * v.y() + zz * v.z()};
  }
};

/// Returns the trace of the product of two conics.
[[nodiscard]] inline double contraction(const conic& a, const conic& b) noexcept {
  return a.xx * b.xx + a.yy * b.yy + a.zz * b.zz + 2.0 * (a.xy * b.xy + a.xz * b.xz + a.yz * b.yz);
}

/// Computes the two lines of a degenerate conic; returns false if they are complex.
[[nodiscard]] inline bool split_conic(const conic& c, vec3& line, vec3& other) {
  const conic adjugate = c.adjugate();  // -v v^T, where v is half the cross product of the lines
  vec3 v;
  double square;
  if (adjugate.xx <= adjugate.yy && adjugate.xx <= adjugate.zz) {
    v = vec3(adjugate.xx, adjugate.xy, adjugate.xz);
    square = -adjugate.xx;
  } else if (adjugate.yy <= adjugate.zz) {
    v = vec3(adjugate.xy, adjugate.yy, adjugate.yz);
    square = -adjugate.yy;
  } else {
    v = vec3(adjugate.xz, adjugate.yz, adjugate.zz);
    square = -adjugate.zz;
  }
  if (square > 0.0)
    v /= std::sqrt(square);
  else if (square < 0.0 || std::isnan(square))
    return false;
  else
    v = zeros<vec3>();  // the same line twice
  // C + [v]x is the outer product of the lines: each row is a multiple of one line, each column of the other.
  const double m[3][3] = {
      {c.xx, c.xy - v.z(), c.xz + v.y()}, {c.xy + v.z(), c.yy, c.yz - v.x()}, {c.xz - v.y(), c.yz + v.x(), c.zz}};
  std::size_t row = 0, column = 0;
  double largest = -1.0;
  for (std::size_t i = 0; i != 3; ++i)
    for (std::size_t j = 0; j != 3; ++j)
      if (std::fabs(m[i][j]) > largest) {
        largest = std::fabs(m[i][j]);
        row = i;
        column = j;
      }
  line = vec3(m[row][0], m[row][1], m[row][2]);
  other = vec3(m[0][column], m[1][column], m[2][column]);
  return largest > 0.0;
}

/// Refines the depths by Newton's method on the three distances; `l` must be an accurate initial value.
inline void polish_depths(vec3& l, const std::array<double, 3>& cosines, const std::array<double, 3>& squared) {
  const auto [b12, b13, b23] = cosines;
  const auto [a12, a13, a23] = squared;
  const double small = 1e-15 * (a12 + a13 + a23);
  for (int i = 0; i < 5; ++i) {
    const double r12 = l(0) * l(0) + l(1) * l(1) - 2.0 * b12 * l(0) * l(1) - a12;
    const double r13 = l(0) * l(0) + l(2) * l(2) - 2.0 * b13 * l(0) * l(2) - a13;
    const double r23 = l(1) * l(1) + l(2) * l(2) - 2.0 * b23 * l(1) * l(2) - a23;
    if (std::fabs(r12) + std::fabs(r13) + std::fabs(r23) < small) return;
    // Half the Jacobian is [a b 0; c 0 d; 0 e f].
    const double a = l(0) - b12 * l(1), b = l(1) - b12 * l(0), c = l(0) - b13 * l(2);
    const double d = l(2) - b13 * l(0), e = l(1) - b23 * l(2), f = l(2) - b23 * l(1);
    const double determinant = -a * d * e - b * c * f;
    const double length = squared_norm(l);
    if (determinant * determinant < 1e-28 * length * length * length)
      return;  // a double root: no further improvement is possible
    const double scale = 0.5 / determinant;
    l(0) -= scale * (b * d * r23 - d * e * r12 - b * f * r13);
    l(1) -= scale * (a * f * r13 - c * f * r12 - a * d * r23);
    l(2) -= scale * (c * e * r12 - a * e * r13 - b * c * r23);
  }
}

/// Calls `solution(R, t)` for each transform from the world to the camera frame that places `R * points_world[i] + t`
/// on the ray `rays[i]` (a unit vector) for every i. R is a rotation matrix up to rounding.
template <class Solution>
void for_each_p3p(const std::array<vec3, 3>& points_world, const std::array<vec3, 3>& rays, Solution&& solution) {
  const vec3 &y1 = rays[0], &y2 = rays[1], &y3 = rays[2];
  const vec3 d12 = points_world[0] - points_world[1], d13 = points_world[0] - points_world[2];
  const vec3 normal = cross(d12, d13);
  double a12 = squared_norm(d12), a13 = squared_norm(d13);
  double a23 = squared_norm(points_world[1] - points_world[2]);
  const double extent = a12 + a13 + a23;
  const double area = squared_norm(normal);
  if (!(area > 1e-18 * extent * extent) || !std::isfinite(area + sum_entries(y1) + sum_entries(y2) + sum_entries(y3)))
    return;
  a12 /= extent, a13 /= extent, a23 /= extent;
  const double b12 = dot(y1, y2), b13 = dot(y1, y3), b23 = dot(y2, y3);

  conic first{a23, -a23 * b12, 0.0, a23 - a12, a12 * b23, -a12};
  conic second{a23, 0.0, -a23 * b13, -a13, a13 * b23, a23 - a13};
  conic first_adjugate = first.adjugate(), second_adjugate = second.adjugate();
  double c0 = contraction(first_adjugate, first) / 3.0, c1 = contraction(first_adjugate, second);
  double c2 = contraction(second_adjugate, first), c3 = contraction(second_adjugate, second) / 3.0;
  if (std::fabs(c3) < std::fabs(c0)) {
    std::swap(first, second);
    std::swap(c0, c3);
    std::swap(c1, c2);
  }
  const double g = real_root_of_cubic(c3, c2, c1, c0);
  const conic pair{first.xx + g * second.xx, first.xy + g * second.xy, first.xz + g * second.xz,
                   first.yy + g * second.yy, first.yz + g * second.yz, first.zz + g * second.zz};
  std::array<vec3, 2> lines;
  if (!split_conic(pair, lines[0], lines[1])) return;
  // On the lines, first = -g second; use the conic that is not small.
  const conic& q = std::fabs(g) <= 1.0 ? second : first;

  // The inverse of [d12 d13 normal], by rows.
  const double inverse_area = 1.0 / area;
  const vec3 i12 = cross(d13, normal) * inverse_area, i13 = cross(normal, d12) * inverse_area;
  const vec3 i_normal = normal * inverse_area;
  const vec3 centre = (points_world[0] + points_world[1] + points_world[2]) / 3.0;
  const double size = std::sqrt(extent);

  for (const vec3& n : lines) {
    // Find two vectors that span the line by eliminating the coordinate with the largest coefficient.
    const vec3 magnitude = magnitudes(n);
    vec3 u, v;
    if (magnitude.x() >= magnitude.y() && magnitude.x() >= magnitude.z()) {
      u = vec3(-n.y() / n.x(), 1.0, 0.0);
      v = vec3(-n.z() / n.x(), 0.0, 1.0);
    } else if (magnitude.y() >= magnitude.z()) {
      u = vec3(1.0, -n.x() / n.y(), 0.0);
      v = vec3(0.0, -n.z() / n.y(), 1.0);
    } else {
      u = vec3(1.0, 0.0, -n.x() / n.z());
      v = vec3(0.0, 1.0, -n.y() / n.z());
    }
    // Points (cu u + cv v) on the conic satisfy qa cu^2 + 2 qb cu cv + qc cv^2 = 0, in homogeneous coordinates.
    const vec3 qu = q.times(u), qv = q.times(v);
    const double qa = dot(u, qu), qb = dot(u, qv), qc = dot(v, qv);
    const double discriminant = qb * qb - qa * qc;
    // A slightly negative value is a double root, up to rounding.
    if (!(discriminant > -1e-10 * (qa * qa + qb * qb + qc * qc))) continue;
    const double root = -(qb + std::copysign(std::sqrt(std::fmax(0.0, discriminant)), qb));
    for (int k = 0; k != 2; ++k) {
      vec3 l = k == 0 ? vec3(root * u + qa * v) : vec3(qc * u + root * v);  // cu / cv is root / qa, or qc / root
      if (sum_entries(l) < 0.0) l = -l;
      if (!(min_entry(l) > 0.0)) continue;
      const double measured = 2.0 * (squared_norm(l) - b12 * l(0) * l(1) - b13 * l(0) * l(2) - b23 * l(1) * l(2));
      if (!(measured > 0.0)) continue;
      l *= 1.0 / std::sqrt(measured);
      polish_depths(l, {b12, b13, b23}, {a12, a13, a23});
      if (!(min_entry(l) > 0.0) || !std::isfinite(sum_entries(l))) continue;
      l *= size;
      const vec3 p1 = l(0) * y1, p2 = l(1) * y2, p3 = l(2) * y3;
      const vec3 s12 = p1 - p2, s13 = p1 - p3;
      const mat3 rotation = s12 * transposed(i12) + s13 * transposed(i13) + cross(s12, s13) * transposed(i_normal);
      solution(rotation, vec3((p1 + p2 + p3) / 3.0 - rotation * centre));
    }
  }
}

}  // namespace orbis::optimize::detail

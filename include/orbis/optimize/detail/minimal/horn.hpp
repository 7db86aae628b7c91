// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Absolute orientation in closed form.
///
/// Sources: B. K. P. Horn, "Closed-form solution of absolute orientation using unit quaternions", JOSA A 4 (1987); S.
/// Umeyama, PAMI 13 (1991), for the least-squares scale; D. Theobald, "Rapid calculation of RMSDs using a
/// quaternion-based characteristic polynomial", Acta Crystallographica A 61 (2005), for the largest eigenvalue from the
/// characteristic polynomial.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include <orbis/core/jacobi.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/minimal/pair_moments.hpp>

namespace orbis::optimize::detail {

/// A rotation and the trace of the rotated matrix.
struct best_rotation {
  so3::quaternion quaternion;
  double trace = 0.0;
};

/// Returns the rotation that best maps the points a to the points b, given `m`, the sum of `a b^T` over pairs of
/// centred points: the eigenvector of the largest eigenvalue of Horn's symmetric 4x4 matrix. This eigenvalue is the
/// trace. Empty if two rotations are equally good: the points are collinear or coincide.
[[nodiscard]] inline std::optional<best_rotation> find_best_rotation(const mat3& m, double relative_gap) {
  const double size = norm(m);
  if (!(size > 0.0) || !std::isfinite(size)) return std::nullopt;
  const mat3 s = m / size;
  // The lower triangle.
  const double a00 = s(0, 0) + s(1, 1) + s(2, 2), a11 = s(0, 0) - s(1, 1) - s(2, 2);
  const double a22 = -s(0, 0) + s(1, 1) - s(2, 2), a33 = -s(0, 0) - s(1, 1) + s(2, 2);
  const double a10 = s(1, 2) - s(2, 1), a20 = s(2, 0) - s(0, 2), a30 = s(0, 1) - s(1, 0);
  const double a21 = s(0, 1) + s(1, 0), a31 = s(2, 0) + s(0, 2), a32 = s(1, 2) + s(2, 1);

  // The characteristic polynomial is x^4 - 2 |s|^2 x^2 - 8 det(s) x + det(a); det(a) is computed from minors of pairs
  // of rows.
  const auto minors = [](double p0, double p1, double p2, double p3, double q0, double q1, double q2, double q3) {
    return std::array{p0 * q1 - p1 * q0, p0 * q2 - p2 * q0, p0 * q3 - p3 * q0,
                      p1 * q2 - p2 * q1, p1 * q3 - p3 * q1, p2 * q3 - p3 * q2};
  };
  const auto laplace = [](const std::array<double, 6>& u, const std::array<double, 6>& v) {
    return u[0] * v[5] - u[1] * v[4] + u[2] * v[3] + u[3] * v[2] - u[4] * v[1] + u[5] * v[0];
  };
  const double c0 =
      laplace(minors(a00, a10, a20, a30, a10, a11, a21, a31), minors(a20, a21, a22, a32, a30, a31, a32, a33));
  const double c1 = -8.0 * determinant(s);
  // |s| = 1: the largest root is between 1 and sqrt(3), and Newton's method from above decreases monotonically.
  double x = 1.7320508075688774, slope = 0.0;
  for (int i = 0; i != 50; ++i) {
    const double xx = x * x;
    slope = 4.0 * x * (xx - 1.0) + c1;
    if (!(slope > 0.0)) break;
    const double step = ((xx - 2.0) * xx + c1 * x + c0) / slope;
    x -= step;
    if (std::fabs(step) < 1e-15) break;
  }
  // The slope at the root is the product of the distances to the other three roots, two of which are large.
  if (slope > 1e-3) {
    // The largest column of the adjugate of a - x.
    const double b00 = a00 - x, b11 = a11 - x, b22 = a22 - x, b33 = a33 - x;
    const auto low = minors(a20, a21, b22, a32, a30, a31, a32, b33);
    const auto high = minors(b00, a10, a20, a30, a10, b11, a21, a31);
    const std::array<vec4, 4> columns{
        vec4(b11 * low[5] - a21 * low[4] + a31 * low[3], -(a10 * low[5] - a21 * low[2] + a31 * low[1]),
             a10 * low[4] - b11 * low[2] + a31 * low[0], -(a10 * low[3] - b11 * low[1] + a21 * low[0])),
        vec4(-(a10 * low[5] - a20 * low[4] + a30 * low[3]), b00 * low[5] - a20 * low[2] + a30 * low[1],
             -(b00 * low[4] - a10 * low[2] + a30 * low[0]), b00 * low[3] - a10 * low[1] + a20 * low[0]),
        vec4(a31 * high[5] - a32 * high[4] + b33 * high[3], -(a30 * high[5] - a32 * high[2] + b33 * high[1]),
             a30 * high[4] - a31 * high[2] + b33 * high[0], -(a30 * high[3] - a31 * high[1] + a32 * high[0])),
        vec4(-(a21 * high[5] - b22 * high[4] + a32 * high[3]), a20 * high[5] - b22 * high[2] + a32 * high[1],
             -(a20 * high[4] - a21 * high[2] + a32 * high[0]), a20 * high[3] - a21 * high[1] + b22 * high[0])};
    std::size_t best = 0;
    for (std::size_t k = 1; k != 4; ++k)
      if (squared_norm(columns[k]) > squared_norm(columns[best])) best = k;
    const vec4& q = columns[best];
    return best_rotation{so3(so3::quaternion(q[0], q[1], q[2], q[3])).unit_quaternion(), x * size};
  }
  mat4 a;
  a << a00, a10, a20, a30, a10, a11, a21, a31, a20, a21, a22, a32, a30, a31, a32, a33;
  const auto eigen = eigen_of_symmetric<4>(a);
  if (!(eigen.values[3] - eigen.values[2] > relative_gap)) return std::nullopt;
  const mat4& q = eigen.vectors;
  return best_rotation{so3(so3::quaternion(q(0, 3), q(1, 3), q(2, 3), q(3, 3))).unit_quaternion(),
                       eigen.values[3] * size};
}

/// Returns the transform that best maps the first points of n pairs to the second points, given the moments of the
/// pairs; empty if these do not determine a rotation.
[[nodiscard]] inline std::optional<sim3> transform_between(const pair_moments& moments, std::size_t n,
                                                           bool with_scale) {
  const double spread = std::sqrt(moments.from_spread) * std::sqrt(moments.to_spread);
  // Coincident points, up to the rounding of their coordinates.
  const double rounding = 1e-30 * static_cast<double>(n);
  if (!(moments.from_spread > rounding * squared_norm(moments.from_mean)) ||
      !(moments.to_spread > rounding * squared_norm(moments.to_mean)) || !(norm(moments.products) > 1e-10 * spread))
    return std::nullopt;
  const auto turn = find_best_rotation(moments.products, 1e-10);
  if (!turn) return std::nullopt;
  const so3 rotation(turn->quaternion);
  const double scale = with_scale ? turn->trace / moments.from_spread : 1.0;
  return sim3(rotation, moments.to_mean - scale * (rotation * moments.from_mean), scale);
}

/// Returns the transform that best maps the first points of n weighted pairs to the second points; empty if the points
/// do not determine a rotation.
template <class Pair>
[[nodiscard]] std::optional<sim3> align_pairs(std::size_t n, const Pair& pair, bool with_scale) {
  return transform_between(compute_moments(n, pair), n, with_scale);
}

}  // namespace orbis::optimize::detail

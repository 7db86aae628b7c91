// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Steps on the sphere of directions.
#pragma once

#include <cmath>

#include <orbis/core/types.hpp>

namespace orbis::optimize::detail {

/// Two orthonormal columns that are orthogonal to the unit vector `p`; discontinuous only at p.z() == 0.
/// Source: T. Duff et al., "Building an orthonormal basis, revisited", JCGT 6(1), 2017.
[[nodiscard]] inline matrix<3, 2> tangent_basis(const vec3& p) {
  const double sign = std::copysign(1.0, p.z());
  const double a = -1.0 / (sign + p.z());
  const double b = p.x() * p.y() * a;
  matrix<3, 2> columns;
  columns(0, 0) = 1.0 + sign * p.x() * p.x() * a;
  columns(1, 0) = sign * b;
  columns(2, 0) = -sign * p.x();
  columns(0, 1) = b;
  columns(1, 1) = sign + p.y() * p.y() * a;
  columns(2, 1) = -p.y();
  return columns;
}

/// The unit vector that lies a step of `d` radians away from the unit vector `p`, along a great circle. `d` is in
/// `tangent_basis(p)`, which is its derivative by `d` at 0.
[[nodiscard]] inline vec3 step_on_sphere(const vec3& p, const vec2& d) {
  const double angle = std::sqrt(d.x() * d.x() + d.y() * d.y());
  const double factor = angle < 1e-8 ? 1.0 : std::sin(angle) / angle, along = std::cos(angle);
  const matrix<3, 2> b = tangent_basis(p);
  double q[3], square = 0.0;
  for (int i = 0; i != 3; ++i) {
    q[i] = along * p[i] + factor * (b(i, 0) * d[0] + b(i, 1) * d[1]);
    square += q[i] * q[i];
  }
  const double length = std::sqrt(square);
  return {q[0] / length, q[1] / length, q[2] / length};
}

}  // namespace orbis::optimize::detail

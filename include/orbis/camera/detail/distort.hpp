// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The lens distortion of `radial_tangential`.
#pragma once

#include <orbis/core/simd/dispatch.hpp>

namespace orbis::camera::detail {

/// A point on the plane z = 1 after distortion, and the derivative with respect to the point, a symmetric matrix.
template <class T>
struct distorted_point {
  T x, y;
  T by_xx{}, by_xy{}, by_yy{};  ///< the derivative; zero if it is not computed
};

/// Distorts the point (x, y). `d`: `radial_tangential::coefficients`. `T`: double, or a vector of doubles.
template <bool Derivative, class T, class Coefficients>
[[nodiscard]] ORBIS_ALWAYS_INLINE distorted_point<T> distort(const Coefficients& d, const T& x, const T& y) {
  const T xx = x * x, yy = y * y, xy = x * y, s = xx + yy;
  const T numerator = 1.0 + s * (d.k1 + s * (d.k2 + s * d.k3));
  const T reciprocal = 1.0 / (1.0 + s * (d.k4 + s * (d.k5 + s * d.k6)));
  const T g = numerator * reciprocal;
  const double p1 = d.p1, p2 = d.p2;
  distorted_point<T> out{g * x + 2.0 * p1 * xy + p2 * (s + 2.0 * xx), g * y + p1 * (s + 2.0 * yy) + 2.0 * p2 * xy};
  if constexpr (Derivative) {
    const T dn = d.k1 + s * (2.0 * d.k2 + s * (3.0 * d.k3));
    const T dq = d.k4 + s * (2.0 * d.k5 + s * (3.0 * d.k6));
    const T dg = 2.0 * ((dn - g * dq) * reciprocal);
    out.by_xx = g + dg * xx + 2.0 * p1 * y + 6.0 * p2 * x;
    out.by_xy = dg * xy + 2.0 * p1 * x + 2.0 * p2 * y;
    out.by_yy = g + dg * yy + 6.0 * p1 * y + 2.0 * p2 * x;
  }
  return out;
}

}  // namespace orbis::camera::detail

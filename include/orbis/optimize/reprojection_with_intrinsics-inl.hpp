// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of reprojection_with_intrinsics.hpp.
#pragma once

#include <orbis/camera/project_lanes.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/optimize/reprojection-inl.hpp>
#include <orbis/optimize/reprojection_with_intrinsics.hpp>

namespace orbis::optimize {

template <bool Derive, class L>
ORBIS_ALWAYS_INLINE auto bal_reprojection::lanes_in_camera(const view& c, const double* measurements, const L* q, L* r,
                                                           L (*by_q)[3], L (*by_intrinsics)[3]) const {
  const L f = c.focal, k1 = c.k1, k2 = c.k2;
  const L inverse = -1.0 / q[2];
  const L x = q[0] * inverse, y = q[1] * inverse;
  const L s = x * x + y * y;
  const L radial = 1.0 + s * (k1 + s * k2);
  const L scale = f * radial;
  r[0] = scale * x - L::load(measurements);
  r[1] = scale * y - L::load(measurements + 8);
  if constexpr (Derive) {
    const L slope = 2.0 * f * (k1 + 2.0 * k2 * s);
    const L xx = scale + slope * x * x, xy = slope * x * y, yy = scale + slope * y * y;
    by_q[0][0] = xx * inverse;
    by_q[0][1] = by_q[1][0] = xy * inverse;
    by_q[1][1] = yy * inverse;
    by_q[0][2] = (xx * x + xy * y) * inverse;
    by_q[1][2] = (xy * x + yy * y) * inverse;
    const L fs = f * s;
    by_intrinsics[0][0] = radial * x;
    by_intrinsics[1][0] = radial * y;
    by_intrinsics[0][1] = fs * x;
    by_intrinsics[1][1] = fs * y;
    by_intrinsics[0][2] = fs * s * x;
    by_intrinsics[1][2] = fs * s * y;
  }
  const auto off_plane = !(q[2] == L(0.0));
  return off_plane & camera::is_finite(r[0], r[1]);
}

}  // namespace orbis::optimize

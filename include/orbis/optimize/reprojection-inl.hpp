// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of reprojection.hpp.
#pragma once

#include <orbis/camera/project_lanes.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/optimize/reprojection.hpp>

namespace orbis::optimize {

template <camera::camera_model Camera>
template <bool Derive, class L>
ORBIS_ALWAYS_INLINE auto reprojection<Camera>::lanes_in_camera(const view&, const double* measurements, const L* q,
                                                               L* r, L (*by_q)[3], L (*)[1]) const {
  camera::lane_projection<L> p;
  camera::lanes_of<Camera>::template project<Derive>(camera, q[0], q[1], q[2], p);
  const L depth_weight = L::load(measurements + 24), inverse_z = 1.0 / q[2];
  const L shift = bf * inverse_z;
  r[0] = p.u - L::load(measurements);
  r[1] = p.v - L::load(measurements + 8);
  const L wx = L::load(measurements + 32), wy = L::load(measurements + 40), along = wx * r[0] + wy * r[1];
  r[2] = depth_weight * ((p.u - shift) - L::load(measurements + 16) - along * wx);
  r[0] -= along * wx;
  r[1] -= along * wy;
  if constexpr (Derive) {
    for (int i = 0; i != 3; ++i) {
      const L change = wx * p.j[0][i] + wy * p.j[1][i];
      by_q[0][i] = p.j[0][i] - change * wx;
      by_q[1][i] = p.j[1][i] - change * wy;
      by_q[2][i] = depth_weight * (i == 2 ? by_q[0][2] + shift * inverse_z : by_q[0][i]);
    }
  }
  return p.valid;
}

}  // namespace orbis::optimize

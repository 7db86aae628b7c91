// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Rays of a camera with lens distortion, eight pixels at a time.
#pragma once

#include <limits>

#include <orbis/camera/intrinsics.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/mask.hpp>
#include <orbis/core/simd/vec.hpp>

namespace orbis::camera::detail {

/// `radial_tangential::unproject` for eight pixels of a row: Newton's method from the distorted position. NaN where
/// that fails. The bits are those of `unproject`, unless the compiler fuses products with sums there.
struct unproject_eight {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const radial_tangential& camera, int first, int row, double* x_of, double* y_of) {
    using lanes = simd::vec<double, 8, Target>;
    const intrinsics& k = camera.k();
    const radial_tangential::coefficients& d = camera.distortion();
    const lanes target_x = (lanes::iota() + static_cast<double>(first) - k.cx) / k.fx;
    const lanes target_y((row - k.cy) / k.fy);
    const double domain = camera.max_squared_radius();
    lanes x = target_x, y = target_y, found_x(std::numeric_limits<double>::quiet_NaN()), found_y = found_x;
    auto searches = x == x;
    for (int i = 0; i != radial_tangential::max_iterations && simd::any(searches); ++i) {
      const lanes s = x * x + y * y;
      const lanes n = 1.0 + s * (d.k1 + s * (d.k2 + s * d.k3)), dn = d.k1 + s * (2.0 * d.k2 + s * 3.0 * d.k3);
      const lanes q = 1.0 + s * (d.k4 + s * (d.k5 + s * d.k6)), dq = d.k4 + s * (2.0 * d.k5 + s * 3.0 * d.k6);
      const lanes g = n / q, dg = (dn - g * dq) / q;
      const lanes u = g * x + 2.0 * d.p1 * x * y + d.p2 * (s + 2.0 * x * x) - target_x;
      const lanes v = g * y + d.p1 * (s + 2.0 * y * y) + 2.0 * d.p2 * x * y - target_y;
      const lanes mixed = 2.0 * (dg * x * y + d.p1 * x + d.p2 * y);
      const lanes j00 = g + 2.0 * dg * x * x + 2.0 * d.p1 * y + 6.0 * d.p2 * x;
      const lanes j11 = g + 2.0 * dg * y * y + 6.0 * d.p1 * y + 2.0 * d.p2 * x;
      const lanes determinant = j00 * j11 - mixed * mixed;
      const lanes dx = (j11 * u - mixed * v) / determinant, dy = (j00 * v - mixed * u) / determinant;
      x = x - dx;
      y = y - dy;
      const lanes squared = x * x + y * y;
      searches = searches & (determinant > lanes(0.0)) & (squared < lanes(domain));
      const auto found = searches & (dx * dx + dy * dy <= radial_tangential::converged * (1.0 + squared));
      found_x = select(found, x, found_x);
      found_y = select(found, y, found_y);
      searches = simd::and_not(searches, found);
    }
    found_x.store(x_of);
    found_y.store(y_of);
  }
};

}  // namespace orbis::camera::detail

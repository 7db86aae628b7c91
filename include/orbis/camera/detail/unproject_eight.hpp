// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Rays of a camera with lens distortion, eight pixels at a time.
#pragma once

#include <limits>

#include <orbis/camera/detail/distort.hpp>
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
      const auto p = distort<true>(d, x, y);
      const lanes u = p.x - target_x, v = p.y - target_y;
      const lanes determinant = p.by_xx * p.by_yy - p.by_xy * p.by_xy, inverse = 1.0 / determinant;
      const lanes dx = (p.by_yy * u - p.by_xy * v) * inverse, dy = (p.by_xx * v - p.by_xy * u) * inverse;
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

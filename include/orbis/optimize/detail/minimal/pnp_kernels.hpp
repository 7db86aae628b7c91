// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The two loops of PnP over its matches: reprojection errors and normal equations. Every instruction set gives the
/// same bits.
#pragma once

#include <cstddef>
#include <limits>

#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/math.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/optimize/detail/unroll.hpp>

namespace orbis::optimize::detail {

/// Squared errors of 32 matches. `columns` are the lists of coordinates, `stride` apart; `pose` is the rotation by
/// rows, with the translation as a fourth column.
using match_errors = void(const float* columns, std::size_t stride, const float* pose, float* out);

/// The normal equations of four times `groups` matches: the lower triangle of H by rows (21 numbers), g (6) and the sum
/// of squared errors, as four partial sums each.
using match_equations = void(const double* columns, std::size_t stride, std::size_t groups, const double* pose,
                             double* out);
inline constexpr int equation_sums = 28;

/// Row `row` of the pose times the point.
template <class V, class S>
[[nodiscard]] ORBIS_ALWAYS_INLINE V moved(const S* row, const V& x, const V& y, const V& z) noexcept {
  return ((row[3] + row[0] * x) + row[1] * y) + row[2] * z;
}

struct match_errors_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const float* columns, std::size_t stride, const float* pose, float* out) {
    using V = simd::vec<float, Target::bytes / sizeof(float), Target>;
    for (std::size_t i = 0; i != 32; i += V::count) {
      const auto at = [&](std::size_t k) ORBIS_INLINE_LAMBDA { return V::load(columns + k * stride + i); };
      const V px = at(0), py = at(1), pz = at(2);
      const V z = moved(pose + 8, px, py, pz), x = moved(pose, px, py, pz), y = moved(pose + 4, px, py, pz);
      const V inverse = 1.0F / z;
      const V dx = x * inverse - at(3), dy = y * inverse - at(4);
      const V u = at(5) * dx + at(6) * dy, v = at(7) * dy;
      select(V(0.0F) < z, u * u + v * v, V(std::numeric_limits<float>::infinity())).store(out + i);
    }
  }
};

struct match_equations_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const double* columns, std::size_t stride, std::size_t groups, const double* pose,
                                      double* out) {
    using V = simd::vec<double, 4, Target>;
    V sums[equation_sums];
    unroll<equation_sums>([&](auto k) ORBIS_INLINE_LAMBDA { sums[k] = 0.0; });
    for (std::size_t group = 0; group != groups; ++group) {
      const auto at = [&](std::size_t k) ORBIS_INLINE_LAMBDA { return V::load(columns + k * stride + 4 * group); };
      const V px = at(0), py = at(1), pz = at(2);
      const V p0 = moved(pose, px, py, pz), p1 = moved(pose + 4, px, py, pz), p2 = moved(pose + 8, px, py, pz);
      const V inverse = 1.0 / p2, xx = at(5), xy = at(6), yy = at(7);
      const V x = p0 * inverse, y = p1 * inverse;
      const V dx = x - at(3), dy = y - at(4);
      const V u = xx * dx + xy * dy, v = yy * dy;
      // The derivatives of u and v by the point, then by a motion of it: rho + phi x p.
      V a[6], b[6];
      a[0] = xx * inverse;
      a[1] = xy * inverse;
      a[2] = -(a[0] * x + a[1] * y);
      a[3] = p1 * a[2] - p2 * a[1];
      a[4] = p2 * a[0] - p0 * a[2];
      a[5] = p0 * a[1] - p1 * a[0];
      b[1] = yy * inverse;
      b[2] = -(b[1] * y);
      b[3] = p1 * b[2] - p2 * b[1];
      b[4] = -(p0 * b[2]);
      b[5] = p0 * b[1];
      unroll<6>([&](auto r) ORBIS_INLINE_LAMBDA {
        unroll<r + 1>([&](auto c) ORBIS_INLINE_LAMBDA {
          constexpr int k = r * (r + 1) / 2 + c;
          sums[k] += a[r] * a[c];
          if constexpr (c != 0) sums[k] += b[r] * b[c];
        });
        sums[21 + r] += a[r] * u;
        if constexpr (r != 0) sums[21 + r] += b[r] * v;
      });
      sums[27] += u * u;
      sums[27] += v * v;
    }
    unroll<equation_sums>([&](auto k) ORBIS_INLINE_LAMBDA { sums[k].store(out + 4 * k); });
  }
};

/// The loops for this processor.
struct match_kernels {
  match_errors* errors = simd::kernel<match_errors_kernel, match_errors>();
  match_equations* equations = simd::kernel<match_equations_kernel, match_equations>();
};

}  // namespace orbis::optimize::detail

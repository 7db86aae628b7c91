// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Moments of pairs of points.
#pragma once

#include <cstddef>

#include <orbis/core/types.hpp>

namespace orbis::optimize::detail {

/// The moments of pairs of points for absolute orientation.
struct pair_moments {
  vec3 from_mean, to_mean;
  mat3 products;  ///< sum of (from - mean) (to - mean)^T
  double from_spread = 0.0, to_spread = 0.0;
};

/// Computes the moments of n pairs: `pair(i, a, b)` writes the i-th pair as two arrays of three doubles and returns its
/// weight. O(n), two passes.
template <class Pair>
[[nodiscard]] pair_moments compute_moments(std::size_t n, const Pair& pair) {
  // Separate sums for even and odd pairs shorten the dependency chain.
  double sums[2][7] = {};
  for (std::size_t i = 0; i != n; ++i) {
    double a[3], b[3];
    const double w = pair(i, a, b);
    double* const sum = sums[i % 2];
    for (std::size_t k = 0; k != 3; ++k) {
      sum[k] += w * a[k];
      sum[3 + k] += w * b[k];
    }
    sum[6] += w;
  }
  double mean[6];
  for (std::size_t k = 0; k != 6; ++k) mean[k] = (sums[0][k] + sums[1][k]) / (sums[0][6] + sums[1][6]);
  double m[11] = {};
  for (std::size_t i = 0; i != n; ++i) {
    double a[3], b[3];
    const double w = pair(i, a, b);
    const double px = a[0] - mean[0], py = a[1] - mean[1], pz = a[2] - mean[2];
    const double ax = w * px, ay = w * py, az = w * pz;
    const double bx = b[0] - mean[3], by = b[1] - mean[4], bz = b[2] - mean[5];
    m[0] += ax * bx, m[1] += ax * by, m[2] += ax * bz;
    m[3] += ay * bx, m[4] += ay * by, m[5] += ay * bz;
    m[6] += az * bx, m[7] += az * by, m[8] += az * bz;
    m[9] += ax * px + ay * py + az * pz;
    m[10] += w * (bx * bx + by * by + bz * bz);
  }
  pair_moments out;
  out.from_mean = vec3(mean[0], mean[1], mean[2]);
  out.to_mean = vec3(mean[3], mean[4], mean[5]);
  out.products << m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8];
  out.from_spread = m[9];
  out.to_spread = m[10];
  return out;
}

}  // namespace orbis::optimize::detail

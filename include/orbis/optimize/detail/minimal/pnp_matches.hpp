// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Matches between known points and pixels, prepared for PnP, and the two loops over them: reprojection errors and
/// normal equations. Every instruction set gives the same bits.
///
/// A pixel is stored as the point (x, y) of its ray at z = 1, and as the derivative of the pixel by that point, made
/// upper triangular by a rotation. The error in pixels is this matrix times the difference at z = 1: exact without
/// distortion, and correct to first order with it, which is enough to rank poses. So the loops do not depend on the
/// camera's type.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/optimize/detail/minimal/wide.hpp>

namespace orbis::optimize::detail {

/// From the world, with the centre of the points as origin, to the camera.
struct centred_pose {
  mat3 rotation = mat3::Identity();
  vec3 translation = vec3::Zero();
};

/// The coordinates of a match, each in a list of its own: X Y Z, x y, and the three entries of the derivative.
inline constexpr std::size_t match_coordinates = 8;

/// Squared errors of 32 matches. `columns` are the lists of coordinates, `stride` apart; `pose` is the rotation by
/// rows, with the translation as a fourth column.
using match_errors = void(const float* columns, std::size_t stride, const float* pose, float* out);

/// The normal equations of four times `groups` matches: the lower triangle of H by rows (21 numbers), g (6) and the sum
/// of squared errors, as four partial sums each.
using match_equations = void(const double* columns, std::size_t stride, std::size_t groups, const double* pose,
                             double* out);
inline constexpr std::size_t equation_sums = 28;

/// Row `k` of the pose times the point.
template <class V, class S>
[[gnu::always_inline]] inline void moved(V& out, const S* row, const V& x, const V& y, const V& z) noexcept {
  using namespace wide;
  V a, b, c;
  fill(out, row[3]);
  fill(a, row[0]);
  fill(b, row[1]);
  fill(c, row[2]);
  add_product(out, a, x);
  add_product(out, b, y);
  add_product(out, c, z);
}

template <class V>
[[gnu::always_inline]] inline void match_errors_in_lanes(const float* columns, std::size_t stride, const float* pose,
                                                         float* out) noexcept {
  using namespace wide;
  constexpr std::size_t width = sizeof(V) / sizeof(float);
  V one;
  fill(one, 1.0F);
  for (std::size_t i = 0; i != 32; i += width) {
    const float* const at = columns + i;
    V px, py, pz, x, y, z;
    load(px, at);
    load(py, at + stride);
    load(pz, at + 2 * stride);
    moved(z, pose + 8, px, py, pz);
    moved(x, pose, px, py, pz);
    moved(y, pose + 4, px, py, pz);
    const V inverse = one / z;
    V seen_x, seen_y, xx, xy, yy;
    load(seen_x, at + 3 * stride);
    load(seen_y, at + 4 * stride);
    load(xx, at + 5 * stride);
    load(xy, at + 6 * stride);
    load(yy, at + 7 * stride);
    V dx, dy, u, v, squared;
    multiply(dx, x, inverse);
    multiply(dy, y, inverse);
    dx -= seen_x;
    dy -= seen_y;
    multiply(u, xx, dx);
    add_product(u, xy, dy);
    multiply(v, yy, dy);
    multiply(squared, u, u);
    add_product(squared, v, v);
    spoil_where_negative(squared, z);
    store(out + i, squared);
  }
}

/// The lanes from `offset` on of every group of four.
template <class V>
[[gnu::always_inline]] inline void match_equations_in_lanes(const double* columns, std::size_t stride,
                                                            std::size_t groups, const double* pose, double* out,
                                                            std::size_t offset) noexcept {
  using namespace wide;
  V sums[equation_sums];
  unrolled<equation_sums>([&](auto k) __attribute__((always_inline)) { sums[k] = V{}; });
  V one;
  fill(one, 1.0);
  for (std::size_t group = 0; group != groups; ++group) {
    const double* const at = columns + 4 * group + offset;
    V px, py, pz, p0, p1, p2;
    load(px, at);
    load(py, at + stride);
    load(pz, at + 2 * stride);
    moved(p0, pose, px, py, pz);
    moved(p1, pose + 4, px, py, pz);
    moved(p2, pose + 8, px, py, pz);
    const V inverse = one / p2;
    V seen_x, seen_y, xx, xy, yy, x, y, u, v;
    load(seen_x, at + 3 * stride);
    load(seen_y, at + 4 * stride);
    load(xx, at + 5 * stride);
    load(xy, at + 6 * stride);
    load(yy, at + 7 * stride);
    multiply(x, p0, inverse);
    multiply(y, p1, inverse);
    const V dx = x - seen_x, dy = y - seen_y;
    multiply(u, xx, dx);
    add_product(u, xy, dy);
    multiply(v, yy, dy);
    // The derivatives of u and v by the point, then by a motion of it: rho + phi x p.
    V a[6], b[6];
    multiply(a[0], xx, inverse);
    multiply(a[1], xy, inverse);
    multiply(a[2], a[0], x);
    add_product(a[2], a[1], y);
    a[2] = -a[2];
    multiply(a[3], p1, a[2]);
    subtract_product(a[3], p2, a[1]);
    multiply(a[4], p2, a[0]);
    subtract_product(a[4], p0, a[2]);
    multiply(a[5], p0, a[1]);
    subtract_product(a[5], p1, a[0]);
    multiply(b[1], yy, inverse);
    multiply(b[2], b[1], y);
    b[2] = -b[2];
    multiply(b[3], p1, b[2]);
    subtract_product(b[3], p2, b[1]);
    multiply(b[4], p0, b[2]);
    b[4] = -b[4];
    multiply(b[5], p0, b[1]);
    unrolled<6>([&](auto r) __attribute__((always_inline)) {
      unrolled<r + 1>([&](auto c) __attribute__((always_inline)) {
        constexpr std::size_t k = r * (r + 1) / 2 + c;
        add_product(sums[k], a[r], a[c]);
        if constexpr (c != 0) add_product(sums[k], b[r], b[c]);
      });
      add_product(sums[21 + r], a[r], u);
      if constexpr (r != 0) add_product(sums[21 + r], b[r], v);
    });
    add_product(sums[27], u, u);
    add_product(sums[27], v, v);
  }
  unrolled<equation_sums>([&](auto k) __attribute__((always_inline)) { store(out + 4 * k + offset, sums[k]); });
}

inline void match_errors_portable(const float* columns, std::size_t stride, const float* pose, float* out) {
  match_errors_in_lanes<wide::numbers<float, 4>>(columns, stride, pose, out);
}
inline void match_equations_portable(const double* columns, std::size_t stride, std::size_t groups, const double* pose,
                                     double* out) {
  for (const std::size_t offset : {std::size_t{0}, std::size_t{2}})
    match_equations_in_lanes<wide::numbers<double, 2>>(columns, stride, groups, pose, out, offset);
}
#if ORBIS_X86
ORBIS_TARGET("avx2")
inline void match_errors_avx2(const float* columns, std::size_t stride, const float* pose, float* out) {
  match_errors_in_lanes<wide::numbers<float, 8>>(columns, stride, pose, out);
}
ORBIS_TARGET("avx512f,avx512dq,avx512vl,avx512bw")
inline void match_errors_avx512(const float* columns, std::size_t stride, const float* pose, float* out) {
  match_errors_in_lanes<wide::numbers<float, 16>>(columns, stride, pose, out);
}
ORBIS_TARGET("avx2")
inline void match_equations_avx2(const double* columns, std::size_t stride, std::size_t groups, const double* pose,
                                 double* out) {
  match_equations_in_lanes<wide::numbers<double, 4>>(columns, stride, groups, pose, out, 0);
}
/// Twice as many registers keep all sums out of memory.
ORBIS_TARGET("avx512f,avx512dq,avx512vl,avx512bw")
inline void match_equations_avx512(const double* columns, std::size_t stride, std::size_t groups, const double* pose,
                                   double* out) {
  match_equations_in_lanes<wide::numbers<double, 4>>(columns, stride, groups, pose, out, 0);
}
#endif

struct match_kernels {
  match_errors* errors;
  match_equations* equations;

  [[nodiscard]] static match_kernels at(simd::level level) {
#if ORBIS_X86
    return {simd::select<match_errors>(
                level, {.portable = match_errors_portable, .avx2 = match_errors_avx2, .avx512 = match_errors_avx512}),
            simd::select<match_equations>(level, {.portable = match_equations_portable,
                                                  .avx2 = match_equations_avx2,
                                                  .avx512 = match_equations_avx512})};
#else
    static_cast<void>(level);
    return {match_errors_portable, match_equations_portable};
#endif
  }
};

/// The usable matches of two lists, in an order that depends only on the seed.
struct pnp_matches {
  std::vector<std::uint32_t> original;  ///< which match of the caller's lists this is
  std::vector<vec3> points;             ///< about the centre
  std::vector<vec3> rays;               ///< unit vectors
  std::vector<double> columns;          ///< eight lists, `stride` apart
  std::vector<float> float_columns;     ///< likewise
  std::vector<double> gathered;         ///< those of one refinement
  std::size_t stride = 0;               ///< size, rounded up to whole blocks
  vec3 centre = vec3::Zero();

  [[nodiscard]] std::size_t size() const noexcept { return original.size(); }

  /// Reads the matches, without those that are not finite or cannot be unprojected. @pre the spans have one length
  template <camera::camera_model Camera>
  void assign(std::span<const vec3> points_world, std::span<const vec2> pixels, const Camera& camera,
              std::uint64_t seed) {
    original.clear();
    original.reserve(points_world.size());
    for (std::size_t i = 0; i != points_world.size(); ++i)
      if (points_world[i].allFinite() && pixels[i].allFinite()) original.push_back(static_cast<std::uint32_t>(i));
    random_bits random(mix64(seed));
    shuffle(original, random);

    stride = (original.size() + 31) / 32 * 32;
    columns.assign(match_coordinates * stride, std::numeric_limits<double>::quiet_NaN());
    points.clear();
    rays.clear();
    points.reserve(original.size());
    rays.reserve(original.size());
    centre.setZero();
    std::size_t kept = 0;
    for (const std::uint32_t i : original) {
      matrix<2, 3> by_point;
      const auto ray = camera.unproject(pixels[i]);
      if (!ray || !camera.project(*ray, by_point)) continue;
      // R of the QR decomposition of the derivative by x and y.
      const double length = std::hypot(by_point(0, 0), by_point(1, 0));
      const double along = (by_point(0, 0) * by_point(0, 1) + by_point(1, 0) * by_point(1, 1)) / length;
      const double across = (by_point(0, 0) * by_point(1, 1) - by_point(1, 0) * by_point(0, 1)) / length;
      if (!(length > 0.0) || !std::isfinite(along + across)) continue;
      const double values[] = {ray->x(), ray->y(), length, along, across};
      for (std::size_t k = 0; k != 5; ++k) columns[(3 + k) * stride + kept] = values[k];
      original[kept++] = i;
      points.push_back(points_world[i]);
      rays.push_back(ray->normalized());
      centre += points_world[i];
    }
    original.resize(kept);
    if (kept != 0) centre /= static_cast<double>(kept);
    for (std::size_t i = 0; i != kept; ++i) {
      points[i] -= centre;
      for (std::size_t k = 0; k != 3; ++k) columns[k * stride + i] = points[i][static_cast<Eigen::Index>(k)];
    }
    float_columns.resize(columns.size());
    for (std::size_t k = 0; k != columns.size(); ++k) float_columns[k] = static_cast<float>(columns[k]);
  }
};

}  // namespace orbis::optimize::detail

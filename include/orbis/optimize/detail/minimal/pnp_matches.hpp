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
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/math.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/unroll.hpp>

namespace orbis::optimize::detail {

/// From the world, with the centre of the points as origin, to the camera.
struct centred_pose {
  mat3 rotation = identity<mat3>();
  vec3 translation = zeros<vec3>();
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

/// The usable matches of two lists, in an order that depends only on the seed.
struct pnp_matches {
  std::vector<std::uint32_t> original;  ///< which match of the caller's lists this is
  std::vector<vec3> points;             ///< about the centre
  std::vector<vec3> rays;               ///< unit vectors
  std::vector<double> columns;          ///< eight lists, `stride` apart
  std::vector<float> float_columns;     ///< likewise
  std::vector<double> gathered;         ///< those of one refinement
  std::size_t stride = 0;               ///< size, rounded up to whole blocks
  vec3 centre = zeros<vec3>();

  [[nodiscard]] std::size_t size() const noexcept { return original.size(); }

  /// Reads the matches, without those that are not finite or cannot be unprojected. @pre the spans have one length
  template <camera::camera_model Camera>
  void assign(std::span<const vec3> points_world, std::span<const vec2> pixels, const Camera& camera,
              std::uint64_t seed) {
    original.clear();
    original.reserve(points_world.size());
    for (std::size_t i = 0; i != points_world.size(); ++i)
      if (all_finite(points_world[i]) && all_finite(pixels[i])) original.push_back(static_cast<std::uint32_t>(i));
    random_bits random(mix64(seed));
    shuffle(original, random);

    stride = (original.size() + 31) / 32 * 32;
    columns.assign(match_coordinates * stride, std::numeric_limits<double>::quiet_NaN());
    points.clear();
    rays.clear();
    points.reserve(original.size());
    rays.reserve(original.size());
    centre = zeros<vec3>();
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

ORBIS_COMPILED_KERNEL(orbis::optimize::detail::match_errors_kernel, orbis::optimize::detail::match_errors);
ORBIS_COMPILED_KERNEL(orbis::optimize::detail::match_equations_kernel, orbis::optimize::detail::match_equations);

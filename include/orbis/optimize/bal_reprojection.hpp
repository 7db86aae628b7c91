// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The camera of "Bundle adjustment in the large": a pose, a focal length and two radial distortions.
///
/// Source of the model: S. Agarwal, N. Snavely, S. M. Seitz, R. Szeliski, "Bundle adjustment in the
/// large", ECCV 2010.
#pragma once

#include <array>
#include <cmath>
#include <concepts>
#include <optional>
#include <span>

#include <orbis/camera/project_lanes.hpp>
#include <orbis/core/lanes.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/optimize/bundle_summary.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/residual.hpp>

namespace orbis::optimize {

/// With p = R X + t the pixel of a point is `-f (1 + k1 r^2 + k2 r^4) (p.x, p.y) / p.z`, r^2 =
/// (p.x^2 + p.y^2) / p.z^2, counted from the middle of the image, x right, y up: the camera looks
/// along -z.
struct bal_camera {
  se3 T_camera_world;
  double focal = 1.0;  ///< pixels
  double k1 = 0.0, k2 = 0.0;

  /// Rotation vector, translation, focal length, k1, k2: as in the files.
  [[nodiscard]] static bal_camera from_parameters(std::span<const double, 9> p) {
    return {se3{so3::exp(vec3{p[0], p[1], p[2]}), vec3{p[3], p[4], p[5]}}, p[6], p[7], p[8]};
  }
  [[nodiscard]] std::array<double, 9> parameters() const {
    const vec3 r = T_camera_world.rotation().log();
    const vec3& t = T_camera_world.translation();
    return {r.x(), r.y(), r.z(), t.x(), t.y(), t.z(), focal, k1, k2};
  }
};

/// A step turns and moves the camera in its own frame, then adds to focal length, k1 and k2.
struct bal_manifold {
  using point = bal_camera;
  using tangent = matrix<9>;
  static constexpr int dimension = 9;

  [[nodiscard]] static point retract(const point& p, const tangent& d) {
    vec6 back;
    for (int i = 0; i != 6; ++i) back[i] = -d[i];
    return {se3::exp(back) * p.T_camera_world, p.focal + d[6], p.k1 + d[7], p.k2 + d[8]};
  }
  [[nodiscard]] static tangent local(const point& p, const point& q) {
    const vec6 back = (q.T_camera_world * p.T_camera_world.inverse()).log();
    tangent d;
    for (int i = 0; i != 6; ++i) d[i] = -back[i];
    d[6] = q.focal - p.focal, d[7] = q.k1 - p.k1, d[8] = q.k2 - p.k2;
    return d;
  }
};

struct bal_view : camera_view {
  double focal = 1.0, k1 = 0.0, k2 = 0.0;
};

/// Projected minus observed, pixels; `right` of the observations is not looked at. Points behind the
/// camera have the projection that the formula gives them. Satisfies `camera_frame_residual`.
struct bal_reprojection {
  using camera_state = bal_camera;
  using camera_manifold = bal_manifold;
  using observation = bundle_observation;
  using view = bal_view;
  static constexpr int dimension = 2;
  static constexpr int intrinsic_dimension = 3;

  [[nodiscard]] static view prepare(const bal_camera& c) {
    return {{c.T_camera_world.rotation_matrix(), c.T_camera_world.translation()}, c.focal, c.k1, c.k2};
  }
  [[nodiscard]] static bool is_usable(const observation& o) {
    return o.information > 0.0 && std::isfinite(o.information) && std::isfinite(o.pixel.x()) &&
           std::isfinite(o.pixel.y());
  }
  [[nodiscard]] static std::optional<vec2> residual(const view& v, const vec3& point, const observation& o) {
    return residual_in_camera(v, v.rotation * point + v.translation, o);
  }
  template <std::same_as<double> S = double>  // so that only who calls it has it compiled
  [[nodiscard]] static std::optional<vec2> linearize(const view& v, const vec3& point, const observation& o,
                                                     matrix<2, 9, S>& by_camera, matrix<2, 3, S>& by_point) {
    return detail::linearize_through_camera(bal_reprojection{}, v, point, o, by_camera, by_point);
  }
  [[nodiscard]] static std::optional<vec2> residual_in_camera(const view& c, const vec3& q, const observation& o) {
    const double x = q.x() / -q.z(), y = q.y() / -q.z();
    const double s = x * x + y * y;
    const double scale = c.focal * (1.0 + s * (c.k1 + s * c.k2));
    const vec2 r(scale * x - o.pixel.x(), scale * y - o.pixel.y());
    if (!std::isfinite(r.x()) || !std::isfinite(r.y())) return std::nullopt;
    return r;
  }
  [[nodiscard]] static std::optional<vec2> linearize_in_camera(const view& c, const vec3& q, const observation& o,
                                                               matrix<2, 3>& by_q, matrix<2, 3>& by_intrinsics) {
    const auto r = residual_in_camera(c, q, o);
    if (!r) return r;
    const double m[2] = {q.x() / -q.z(), q.y() / -q.z()};
    const double s = m[0] * m[0] + m[1] * m[1];
    const double radial = 1.0 + s * (c.k1 + s * c.k2), slope = 2.0 * (c.k1 + 2.0 * c.k2 * s);
    for (int i = 0; i != 2; ++i) {
      double by_m[2];
      for (int k = 0; k != 2; ++k) by_m[k] = c.focal * ((i == k ? radial : 0.0) + slope * m[i] * m[k]);
      by_q(i, 0) = -by_m[0] / q.z();
      by_q(i, 1) = -by_m[1] / q.z();
      by_q(i, 2) = -(by_m[0] * m[0] + by_m[1] * m[1]) / q.z();
      by_intrinsics(i, 0) = radial * m[i];
      by_intrinsics(i, 1) = c.focal * s * m[i];
      by_intrinsics(i, 2) = c.focal * s * s * m[i];
    }
    return r;
  }

  /// Eight observations at once; see `detail::lane_residual`.
  static constexpr int measured = 2;
  static void measure(const observation& o, double* to) {
    to[0] = o.pixel.x();
    to[8] = o.pixel.y();
  }
  template <bool Derive, simd::lane_vector L>
  ORBIS_ALWAYS_INLINE typename L::mask lanes_in_camera(const view& c, const double* measurements, const L* q, L* r,
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
};

}  // namespace orbis::optimize

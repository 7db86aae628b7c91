// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Projects eight points at a time, in vectors of doubles (`core/simd/vec.hpp`): for inner loops.
///
/// `lanes_of<Camera>` exists for every camera model. The library's models have specialisations that give the same bits
/// on every instruction set; any other model uses eight calls to `project`.
#pragma once

#include <array>
#include <cassert>
#include <concepts>
#include <cstddef>
#include <limits>
#include <utility>

#include <orbis/camera/any.hpp>
#include <orbis/camera/detail/distort.hpp>
#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/core/simd/convert.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/math.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/core/types.hpp>

namespace orbis::camera {

/// The vector type for projection: `simd::vec<double, 8, Target>`.
template <class L>
concept double_lanes = requires(const L& x, const double* p) {
  { L::load(p) } -> std::same_as<L>;
  { x* x + 1.0 / x } -> std::same_as<L>;
  select(x < x, x, x);
};
/// Type of the mask that comparisons of `L` return.
template <double_lanes L>
using mask_of = decltype(std::declval<L>() < std::declval<L>());

/// The pixels of eight points in the camera frame, and their derivatives with respect to the point, `j[row][column]`,
/// in pixels per metre. Unspecified in lanes that are not `valid`.
template <double_lanes L>
struct lane_projection {
  L u, v;
  mask_of<L> valid;
  L j[2][3];
};

/// Lanes in which `u` and `v` are finite.
template <double_lanes L>
[[nodiscard]] ORBIS_ALWAYS_INLINE mask_of<L> is_finite(const L& u, const L& v) {
  constexpr double most = std::numeric_limits<double>::max();
  return (u <= L(most)) & (L(-most) <= u) & (v <= L(most)) & (L(-most) <= v);
}

namespace detail {

/// The values of the lanes as an array.
using lane_array = std::array<double, 8>;

struct projected_lanes {
  lane_array u, v, valid;
  std::array<lane_array, 6> j;
};

/// Projects eight points individually. Not inlined into the kernels, because these are compiled for instruction sets
/// that might round differently.
template <camera_model Camera>
[[gnu::noinline]] void project_each(const Camera& camera, const lane_array& x, const lane_array& y, const lane_array& z,
                                    bool with_jacobian, projected_lanes& out) {
  matrix<2, 3> j = zeros<matrix<2, 3>>();
  for (std::size_t i = 0; i != x.size(); ++i) {
    const vec3 p(x[i], y[i], z[i]);
    const auto pixel = with_jacobian ? camera.project(p, j) : camera.project(p);
    out.valid[i] = pixel ? 1.0 : 0.0;
    out.u[i] = pixel ? pixel->x() : 0.0;
    out.v[i] = pixel ? pixel->y() : 0.0;
    for (std::size_t k = 0; k != 6; ++k)
      out.j[k][i] = pixel ? j(static_cast<Eigen::Index>(k / 3), static_cast<Eigen::Index>(k % 3)) : 0.0;
  }
}

/// The angle atan2(r, z) for z > 0 and r >= 0, not both near the limits of double: halves the angle three times, then
/// evaluates the power series.
template <double_lanes L>
[[nodiscard]] ORBIS_ALWAYS_INLINE L angle_off_axis(const L& r, const L& z) {
  L t = r / (z + square_root(r * r + z * z));  // tan(angle / 2), at most 1
  for (int halving = 0; halving != 2; ++halving) t = t / (1.0 + square_root(1.0 + t * t));
  const L s = t * t;  // below 0.04
  L series(1.0 / 23.0);
  for (int n = 21; n > 0; n -= 2) series = 1.0 / n - s * series;
  return 8.0 * t * series;
}

}  // namespace detail

/// `project<Jacobian>(camera, x, y, z, out)`: `camera.project` for eight points in the camera frame, up to rounding;
/// computes the derivatives only if `Jacobian` is true. If `axis_aligned` is true, u does not depend on y, and v does
/// not depend on x.
template <camera_model Camera>
struct lanes_of {
  static constexpr bool axis_aligned = false;

  template <bool Jacobian, double_lanes L>
  static ORBIS_ALWAYS_INLINE void project(const Camera& camera, const L& x, const L& y, const L& z,
                                          lane_projection<L>& out) {
    detail::lane_array px, py, pz;
    x.store(px.data()), y.store(py.data()), z.store(pz.data());
    detail::projected_lanes p;
    detail::project_each(camera, px, py, pz, Jacobian, p);
    out.u = L::load(p.u.data());
    out.v = L::load(p.v.data());
    out.valid = (L(0.0) < L::load(p.valid.data())) & is_finite(out.u, out.v);
    if constexpr (Jacobian)
      for (std::size_t k = 0; k != 6; ++k) out.j[k / 3][k % 3] = L::load(p.j[k].data());
  }
};

template <>
struct lanes_of<pinhole> {
  static constexpr bool axis_aligned = true;

  template <bool Jacobian, double_lanes L>
  static ORBIS_ALWAYS_INLINE void project(const pinhole& camera, const L& x, const L& y, const L& z,
                                          lane_projection<L>& out) {
    const intrinsics& k = camera.k();
    const L inverse = 1.0 / z, a = k.fx * inverse, b = k.fy * inverse;
    const L du = a * x, dv = b * y;
    out.u = du + k.cx;
    out.v = dv + k.cy;
    out.valid = (L(0.0) < z) & is_finite(out.u, out.v);
    if constexpr (Jacobian) {
      out.j[0][0] = a;
      out.j[0][1] = 0.0;
      out.j[0][2] = L(0.0) - du * inverse;
      out.j[1][0] = 0.0;
      out.j[1][1] = b;
      out.j[1][2] = L(0.0) - dv * inverse;
    }
  }
};

template <>
struct lanes_of<radial_tangential> {
  static constexpr bool axis_aligned = false;

  template <bool Jacobian, double_lanes L>
  static ORBIS_ALWAYS_INLINE void project(const radial_tangential& camera, const L& px, const L& py, const L& z,
                                          lane_projection<L>& out) {
    const intrinsics& k = camera.k();
    const L inverse = 1.0 / z, x = px * inverse, y = py * inverse;
    const auto distorted = detail::distort<Jacobian>(camera.distortion(), x, y);
    out.u = k.cx + k.fx * distorted.x;
    out.v = k.cy + k.fy * distorted.y;
    out.valid = (L(0.0) < z) & (x * x + y * y < L(camera.max_squared_radius())) & is_finite(out.u, out.v);
    if constexpr (Jacobian) {
      const L a = k.fx * inverse, b = k.fy * inverse;
      out.j[0][0] = a * distorted.by_xx;
      out.j[0][1] = a * distorted.by_xy;
      out.j[0][2] = L(0.0) - (out.j[0][0] * x + out.j[0][1] * y);
      out.j[1][0] = b * distorted.by_xy;
      out.j[1][1] = b * distorted.by_yy;
      out.j[1][2] = L(0.0) - (out.j[1][0] * x + out.j[1][1] * y);
    }
  }
};

template <>
struct lanes_of<kannala_brandt> {
  static constexpr bool axis_aligned = false;

  template <bool Jacobian, double_lanes L>
  static ORBIS_ALWAYS_INLINE void project(const kannala_brandt& camera, const L& x, const L& y, const L& z,
                                          lane_projection<L>& out) {
    const intrinsics& k = camera.k();
    const kannala_brandt::coefficients& d = camera.distortion();
    const L rr = x * x + y * y, zz = z * z;
    const auto on_axis = rr <= 1e-18 * zz;  // these points use the pinhole model
    const L root = reciprocal_root(select(on_axis, L(1.0), rr));
    const L r = select(on_axis, L(0.0), rr * root);
    const L theta = detail::angle_off_axis(r, z), s = theta * theta;
    const L inverse_z = 1.0 / z;
    const L distorted = theta * (1.0 + s * (d.k1 + s * (d.k2 + s * (d.k3 + s * d.k4))));
    const L scale = select(on_axis, inverse_z, distorted * root);
    out.u = k.fx * (scale * x) + k.cx;
    out.v = k.fy * (scale * y) + k.cy;
    out.valid = (L(0.0) < z) & (theta < L(camera.max_angle())) & is_finite(out.u, out.v);
    if constexpr (Jacobian) {
      const L slope = 1.0 + s * (3.0 * d.k1 + s * (5.0 * d.k2 + s * (7.0 * d.k3 + s * (9.0 * d.k4))));
      const L per_norm = slope / (rr + zz);
      const L along = select(on_axis, inverse_z, per_norm * z);  // d theta_d / d r
      const L by_z = select(on_axis, L(0.0) - inverse_z * inverse_z, L(0.0) - per_norm);
      const L c = select(on_axis, L(0.0), x * root), t = select(on_axis, L(0.0), y * root);
      const L across = (along - scale) * c;
      // The radial derivative is `along` and the tangential one `scale`; their difference is multiplied by the squared
      // direction.
      out.j[0][0] = k.fx * (scale + across * c);
      out.j[0][1] = k.fx * (across * t);
      out.j[0][2] = k.fx * (by_z * x);
      out.j[1][0] = k.fy * (across * t);
      out.j[1][1] = k.fy * (scale + (along - scale) * t * t);
      out.j[1][2] = k.fy * (by_z * y);
    }
  }
};

template <>
struct lanes_of<any_camera> {
  static constexpr bool axis_aligned = false;

  template <bool Jacobian, double_lanes L>
  static ORBIS_ALWAYS_INLINE void project(const any_camera& camera, const L& x, const L& y, const L& z,
                                          lane_projection<L>& out) {
    if (const auto* const distorted = camera.get_if<radial_tangential>())
      lanes_of<radial_tangential>::project<Jacobian>(*distorted, x, y, z, out);
    else if (const auto* const fisheye = camera.get_if<kannala_brandt>())
      lanes_of<kannala_brandt>::project<Jacobian>(*fisheye, x, y, z, out);
    else  // a model that is added to any_camera needs a branch here
      lanes_of<pinhole>::project<Jacobian>(*camera.get_if<pinhole>(), x, y, z, out);
  }
};

/// A kernel for `simd::kernel` that projects points in the camera frame, up to rounding as `camera.project` does.
template <camera_model Camera>
struct projection_kernel {
  /// `axes`: x, y and z of `count` points in the camera frame, metres. `u` and `v`: their pixels, NaN where there is
  /// none. @pre count % 8 == 0
  using signature = void(const Camera& camera, const std::array<const float*, 3>& axes, std::size_t count, double* u,
                         double* v);

  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const Camera& camera, const std::array<const float*, 3>& axes, std::size_t count,
                                      double* u, double* v) {
    using lanes = simd::vec<double, 8, Target>;
    const lanes none(std::numeric_limits<double>::quiet_NaN());
    assert(count % 8 == 0);
    for (std::size_t i = 0; i < count; i += 8) {
      const auto load = [&](const float* axis) ORBIS_INLINE_LAMBDA {
        return simd::convert<double>(simd::vec<float, 8, Target>::load(axis + i));
      };
      lane_projection<lanes> pixel;
      lanes_of<Camera>::template project<false>(camera, load(axes[0]), load(axes[1]), load(axes[2]), pixel);
      select(pixel.valid, pixel.u, none).store(u + i);
      select(pixel.valid, pixel.v, none).store(v + i);
    }
  }
};

}  // namespace orbis::camera

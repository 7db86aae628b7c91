// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Parameters of a camera model, and derivatives of pixels with respect to them, for calibration.
#pragma once

#include <array>
#include <cmath>
#include <concepts>
#include <optional>
#include <string_view>

#include <orbis/camera/intrinsics.hpp>
#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/core/types.hpp>

namespace orbis::camera {

/// Customisation point for `parametric_camera`. Specialise it for user-defined models:
///
/// - `count`: the number of parameters;
/// - `get(camera)`: their values;
/// - `with(camera, p)`: a camera with the same image size and the parameters `p`, empty if they are invalid (a focal
/// length that is not positive, a NaN);
/// - `project(camera, point, by_point, by_parameters)`: like `camera.project(point, by_point)`; also computes the
///   derivative of the pixel with respect to the parameters (2 x count). The derivatives are unchanged if there is
///   no pixel.
template <class Camera>
struct parameters_of {};

/// A camera model whose parameters can be read, changed and differentiated.
template <class C>
concept parametric_camera = camera_model<C> && std::copyable<C> &&
    requires(const C& camera, const vec3& point, const matrix<parameters_of<C>::count>& p, matrix<2, 3>& by_point,
             matrix<2, parameters_of<C>::count>& by_parameters) {
  { parameters_of<C>::get(camera) } -> std::same_as<matrix<parameters_of<C>::count>>;
  { parameters_of<C>::with(camera, p) } -> std::same_as<std::optional<C>>;
  { parameters_of<C>::project(camera, point, by_point, by_parameters) } -> std::same_as<std::optional<vec2>>;
};

namespace detail {

/// `k` with the camera matrix from the first four parameters; empty if any of the `count` parameters is invalid.
[[nodiscard]] inline std::optional<intrinsics> with_camera_matrix(intrinsics k, const double* p, int count) {
  k.fx = p[0], k.fy = p[1], k.cx = p[2], k.cy = p[3];
  for (int i = 4; i != count; ++i)
    if (!std::isfinite(p[i])) return std::nullopt;
  if (!is_valid(k)) return std::nullopt;
  return k;
}

/// Writes the derivative of a pixel with respect to fx, fy, cx and cy to `j`, column by column. `x`, `y`: the distorted
/// position on the plane z = 1.
inline void by_camera_matrix(double x, double y, double* j) {
  j[0] = x, j[1] = 0.0;
  j[2] = 0.0, j[3] = y;
  j[4] = 1.0, j[5] = 0.0;
  j[6] = 0.0, j[7] = 1.0;
}

}  // namespace detail

/// Parameters: fx, fy, cx, cy.
template <>
struct parameters_of<pinhole> {
  static constexpr int count = 4;
  static constexpr std::array<std::string_view, count> names{"fx", "fy", "cx", "cy"};

  [[nodiscard]] static matrix<4> get(const pinhole& c) { return {c.k().fx, c.k().fy, c.k().cx, c.k().cy}; }
  [[nodiscard]] static std::optional<pinhole> with(const pinhole& c, const matrix<4>& p) {
    const auto k = detail::with_camera_matrix(c.k(), p.data(), count);
    if (!k) return std::nullopt;
    return pinhole{*k};
  }
  [[nodiscard]] static std::optional<vec2> project(const pinhole& c, const vec3& point, matrix<2, 3>& by_point,
                                                   matrix<2, 4>& by_parameters) {
    const auto pixel = c.project(point, by_point);
    if (pixel) detail::by_camera_matrix(point.x() / point.z(), point.y() / point.z(), by_parameters.data());
    return pixel;
  }
};

/// Parameters: fx, fy, cx, cy, then the coefficients in OpenCV's order: k1, k2, p1, p2, k3, k4, k5, k6.
template <>
struct parameters_of<radial_tangential> {
  static constexpr int count = 12;
  static constexpr std::array<std::string_view, count> names{"fx", "fy", "cx", "cy", "k1", "k2",
                                                             "p1", "p2", "k3", "k4", "k5", "k6"};

  [[nodiscard]] static matrix<12> get(const radial_tangential& c) {
    const auto& d = c.distortion();
    const double all[count] = {c.k().fx, c.k().fy, c.k().cx, c.k().cy, d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6};
    return Eigen::Map<const matrix<12>>(all);
  }
  [[nodiscard]] static std::optional<radial_tangential> with(const radial_tangential& c, const matrix<12>& p) {
    const auto k = detail::with_camera_matrix(c.k(), p.data(), count);
    if (!k) return std::nullopt;
    return radial_tangential{
        *k, {.k1 = p[4], .k2 = p[5], .p1 = p[6], .p2 = p[7], .k3 = p[8], .k4 = p[9], .k5 = p[10], .k6 = p[11]}};
  }
  [[nodiscard]] static std::optional<vec2> project(const radial_tangential& c, const vec3& point,
                                                   matrix<2, 3>& by_point, matrix<2, 12>& by_parameters) {
    const auto pixel = c.project(point, by_point);
    if (!pixel) return pixel;
    const intrinsics& k = c.k();
    const auto& d = c.distortion();
    const double x = point.x() / point.z(), y = point.y() / point.z();
    const double s = x * x + y * y, ss = s * s, sss = s * ss;
    const double inverse = 1.0 / (1.0 + s * (d.k4 + s * (d.k5 + s * d.k6)));
    const double g = inverse * (1.0 + s * (d.k1 + s * (d.k2 + s * d.k3)));
    double* const j = by_parameters.data();
    detail::by_camera_matrix(g * x + 2.0 * d.p1 * x * y + d.p2 * (s + 2.0 * x * x),
                             g * y + d.p1 * (s + 2.0 * y * y) + 2.0 * d.p2 * x * y, j);
    const double u = k.fx * x * inverse, v = k.fy * y * inverse;  // derivative with respect to the numerator of g
    const double along[8] = {s, ss, 0.0, 0.0, sss, -g * s, -g * ss, -g * sss};
    for (int i = 0; i != 8; ++i) {
      j[8 + 2 * i] = u * along[i];
      j[9 + 2 * i] = v * along[i];
    }
    j[12] = k.fx * 2.0 * x * y;
    j[13] = k.fy * (s + 2.0 * y * y);
    j[14] = k.fx * (s + 2.0 * x * x);
    j[15] = k.fy * 2.0 * x * y;
    return pixel;
  }
};

/// Parameters: fx, fy, cx, cy, k1, k2, k3, k4.
template <>
struct parameters_of<kannala_brandt> {
  static constexpr int count = 8;
  static constexpr std::array<std::string_view, count> names{"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"};

  [[nodiscard]] static matrix<8> get(const kannala_brandt& c) {
    const auto& d = c.distortion();
    const double all[count] = {c.k().fx, c.k().fy, c.k().cx, c.k().cy, d.k1, d.k2, d.k3, d.k4};
    return Eigen::Map<const matrix<8>>(all);
  }
  [[nodiscard]] static std::optional<kannala_brandt> with(const kannala_brandt& c, const matrix<8>& p) {
    const auto k = detail::with_camera_matrix(c.k(), p.data(), count);
    if (!k) return std::nullopt;
    return kannala_brandt{*k, {.k1 = p[4], .k2 = p[5], .k3 = p[6], .k4 = p[7]}};
  }
  [[nodiscard]] static std::optional<vec2> project(const kannala_brandt& c, const vec3& point, matrix<2, 3>& by_point,
                                                   matrix<2, 8>& by_parameters) {
    const auto pixel = c.project(point, by_point);
    if (!pixel) return pixel;
    const intrinsics& k = c.k();
    const auto& d = c.distortion();
    const double r = std::hypot(point.x(), point.y());
    const double theta = std::atan2(r, point.z()), s = theta * theta;
    const double on_axis = 1.0 / point.z();  // theta / r on the optical axis
    const double x = point.x() * (r > 0.0 ? theta / r : on_axis), y = point.y() * (r > 0.0 ? theta / r : on_axis);
    const double g = 1.0 + s * (d.k1 + s * (d.k2 + s * (d.k3 + s * d.k4)));
    double* const j = by_parameters.data();
    detail::by_camera_matrix(g * x, g * y, j);
    double power = s;
    for (int i = 0; i != 4; ++i, power *= s) {
      j[8 + 2 * i] = k.fx * x * power;
      j[9 + 2 * i] = k.fy * y * power;
    }
    return pixel;
  }
};

static_assert(parametric_camera<pinhole> && parametric_camera<radial_tangential> && parametric_camera<kannala_brandt>);

}  // namespace orbis::camera

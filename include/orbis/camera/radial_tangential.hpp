// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The common camera model with radial and tangential lens distortion (OpenCV's 4, 5 or 8 coefficients).
///
/// Model: D. C. Brown, "Decentering distortion of lenses", Photogrammetric Engineering 32(3), 1966; for the
/// denominator: D. Claus, A. Fitzgibbon, "A rational function lens distortion model for general cameras", CVPR 2005.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>

#include <orbis/camera/detail/distort.hpp>
#include <orbis/camera/detail/monotonic.hpp>
#include <orbis/camera/intrinsics.hpp>
#include <orbis/core/types.hpp>

namespace orbis::camera {

namespace detail {
struct unproject_eight;
}

/// The radial-tangential model. With `x, y` on the plane z = 1 and `s = x^2 + y^2`:
/// `g = (1 + k1 s + k2 s^2 + k3 s^3) / (1 + k4 s + k5 s^2 + k6 s^3)`,
/// `x' = g x + 2 p1 x y + p2 (s + 2 x^2)`, `y' = g y + p1 (s + 2 y^2) + 2 p2 x y`.
///
/// The polynomial is accurate only where it was fitted; at large radii it may fold back, so that one pixel has several
/// rays. Points beyond the first fold are outside this model's domain. Satisfies `camera_model`.
class radial_tangential {
 public:
  /// Coefficients in OpenCV's order; omitted coefficients are 0.
  struct coefficients {
    double k1 = 0.0, k2 = 0.0, p1 = 0.0, p2 = 0.0, k3 = 0.0, k4 = 0.0, k5 = 0.0, k6 = 0.0;
    friend bool operator==(const coefficients&, const coefficients&) = default;
  };

  radial_tangential() = default;
  /// @pre is_valid(k), all coefficients finite
  radial_tangential(const intrinsics& k, const coefficients& d) : k_{k}, d_{d}, domain_{domain(d)} {
    assert(is_valid(k));
  }

  [[nodiscard]] int width() const noexcept { return k_.width; }
  [[nodiscard]] int height() const noexcept { return k_.height; }
  /// Image size and camera matrix.
  [[nodiscard]] const intrinsics& k() const noexcept { return k_; }
  [[nodiscard]] const coefficients& distortion() const noexcept { return d_; }
  /// Upper limit of `x^2 + y^2` on the plane z = 1; infinite if the polynomial never folds back.
  [[nodiscard]] double max_squared_radius() const noexcept { return domain_; }

  /// The pixel of a point in the camera frame (metres); empty for z <= 0, outside the domain, and for NaN.
  [[nodiscard]] std::optional<vec2> project(const vec3& p) const {
    if (!(p.z() > 0.0)) return std::nullopt;
    const vec2 m{p.x() / p.z(), p.y() / p.z()};
    return to_pixel(m, detail::distort<false>(d_, m.x(), m.y()));
  }
  /// The pixel of the point, and its derivative with respect to the point. If there is no pixel, `jacobian` is
  /// unchanged.
  [[nodiscard]] std::optional<vec2> project(const vec3& p, matrix<2, 3>& jacobian) const {
    if (!(p.z() > 0.0)) return std::nullopt;
    const vec2 m{p.x() / p.z(), p.y() / p.z()};
    const auto d = detail::distort<true>(d_, m.x(), m.y());
    const auto pixel = to_pixel(m, d);
    if (!pixel) return std::nullopt;
    const double a = k_.fx / p.z(), b = k_.fy / p.z();
    jacobian(0, 0) = a * d.by_xx;
    jacobian(0, 1) = a * d.by_xy;
    jacobian(1, 0) = b * d.by_xy;
    jacobian(1, 1) = b * d.by_yy;
    for (int i = 0; i != 2; ++i) jacobian(i, 2) = -(jacobian(i, 0) * m.x() + jacobian(i, 1) * m.y());
    return pixel;
  }
  /// The ray through a pixel, scaled to z = 1, computed by Newton's method, which starts from the distorted position
  /// or, if that fails, from the solution of the radial part only. Empty if there is no ray within the domain, and for
  /// NaN.
  [[nodiscard]] std::optional<vec3> unproject(const vec2& pixel) const {
    const vec2 target{(pixel.x() - k_.cx) / k_.fx, (pixel.y() - k_.cy) / k_.fy};
    if (!std::isfinite(target.x()) || !std::isfinite(target.y())) return std::nullopt;
    if (const auto ray = newton(target, target)) return ray;
    return newton(target, radial_start(target));
  }

  friend bool operator==(const radial_tangential&, const radial_tangential&) = default;

 private:
  friend struct detail::unproject_eight;
  static constexpr int max_iterations = 30;
  /// Threshold on the squared relative step. The remaining error is about the square of the last step.
  static constexpr double converged = 1e-14;

  /// The ray that distorts to `target`, from the initial guess `m`; every step must stay in the domain.
  [[nodiscard]] std::optional<vec3> newton(const vec2& target, vec2 m) const {
    for (int i = 0; i != max_iterations; ++i) {
      const auto d = detail::distort<true>(d_, m.x(), m.y());
      const double u = d.x - target.x(), v = d.y - target.y();
      const double determinant = d.by_xx * d.by_yy - d.by_xy * d.by_xy, inverse = 1.0 / determinant;
      const double dx = (d.by_yy * u - d.by_xy * v) * inverse, dy = (d.by_xx * v - d.by_xy * u) * inverse;
      m = {m.x() - dx, m.y() - dy};
      const double squared = m.x() * m.x() + m.y() * m.y();
      if (!(determinant > 0.0) || !(squared < domain_)) return std::nullopt;
      if (dx * dx + dy * dy <= converged * (1.0 + squared)) return vec3{m.x(), m.y(), 1.0};
    }
    return std::nullopt;
  }

  /// The pixel of a point `m` on the plane z = 1. `distorted`: `m` after distortion.
  [[nodiscard]] std::optional<vec2> to_pixel(const vec2& m, const detail::distorted_point<double>& distorted) const {
    if (!(m.x() * m.x() + m.y() * m.y() < domain_)) return std::nullopt;
    const vec2 pixel{k_.fx * distorted.x + k_.cx, k_.fy * distorted.y + k_.cy};
    if (!std::isfinite(pixel.x()) || !std::isfinite(pixel.y())) return std::nullopt;
    return pixel;
  }

  /// The ray that distorts to `target` without tangential distortion. If there is none, a ray near the boundary of the
  /// domain.
  [[nodiscard]] vec2 radial_start(const vec2& target) const {
    const double distorted = std::sqrt(target.x() * target.x() + target.y() * target.y());
    if (distorted == 0.0) return target;
    const double end = std::sqrt(domain_);
    coefficients without_tangential = d_;
    without_tangential.p1 = without_tangential.p2 = 0.0;
    const auto scaled = [&](double r) {
      const auto at = detail::distort<true>(without_tangential, r, 0.0);
      return std::pair{at.x, at.by_xx};
    };
    const double r = detail::invert_growing(scaled, distorted, end).value_or(0.99 * std::min(end, distorted));
    const double scale = r / distorted;
    return {target.x() * scale, target.y() * scale};
  }

  /// The squared radius at which `r g(r^2)` stops increasing: with `g = n / q`, the first sign change of `n q + 2 s (n'
  /// q - n q')`, or of `q`.
  [[nodiscard]] static double domain(const coefficients& d) {
    const std::array<double, 4> n{1.0, d.k1, d.k2, d.k3};
    const std::array<double, 4> q{1.0, d.k4, d.k5, d.k6};
    std::array<double, 7> slope{};
    for (std::size_t i = 0; i != 4; ++i)
      for (std::size_t j = 0; j != 4; ++j)
        slope[i + j] += n[i] * q[j] * (1.0 + 2.0 * (static_cast<double>(i) - static_cast<double>(j)));
    return std::min(detail::smallest_positive_root(slope), detail::smallest_positive_root(q));
  }

  intrinsics k_;
  coefficients d_;
  double domain_ = std::numeric_limits<double>::infinity();
};

}  // namespace orbis::camera

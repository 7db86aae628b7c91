// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The fisheye camera model of OpenCV's `cv::fisheye`.
///
/// Model: J. Kannala, S. S. Brandt, "A generic camera model and calibration method for conventional, wide-angle, and
/// fish-eye lenses", PAMI 28(8), 2006; only the radially symmetric part.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include <orbis/camera/detail/monotonic.hpp>
#include <orbis/camera/intrinsics.hpp>
#include <orbis/core/types.hpp>

namespace orbis::camera {

/// The Kannala-Brandt fisheye model. With `theta` the angle between ray and optical axis, a point projects to a
/// distance of `theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8)` focal lengths from the principal point.
///
/// The domain ends where that polynomial stops increasing, or at 90 degrees if that is smaller, because rays are scaled
/// to z = 1. Satisfies `camera_model`.
class kannala_brandt {
 public:
  struct coefficients {
    double k1 = 0.0, k2 = 0.0, k3 = 0.0, k4 = 0.0;
    friend bool operator==(const coefficients&, const coefficients&) = default;
  };

  kannala_brandt() = default;
  /// @pre is_valid(k), all coefficients finite
  kannala_brandt(const intrinsics& k, const coefficients& d) : k_{k}, d_{d}, max_angle_{domain(d)} {
    assert(is_valid(k));
  }

  [[nodiscard]] int width() const noexcept { return k_.width; }
  [[nodiscard]] int height() const noexcept { return k_.height; }
  /// Image size and camera matrix.
  [[nodiscard]] const intrinsics& k() const noexcept { return k_; }
  [[nodiscard]] const coefficients& distortion() const noexcept { return d_; }
  /// Upper limit of the angle between a ray and the optical axis; radians, at most pi / 2.
  [[nodiscard]] double max_angle() const noexcept { return max_angle_; }

  /// The pixel of a point in the camera frame (metres); empty for z <= 0, outside the domain, and for NaN.
  [[nodiscard]] std::optional<vec2> project(const vec3& p) const {
    if (!(p.z() > 0.0)) return std::nullopt;
    const double r = std::hypot(p.x(), p.y());
    const double theta = std::atan2(r, p.z());
    if (!(theta < max_angle_)) return std::nullopt;
    // theta_d / r, which is 1 / z on the axis
    const double scale = r > 0.0 ? radial(theta).first / r : 1.0 / p.z();
    const vec2 pixel{k_.fx * scale * p.x() + k_.cx, k_.fy * scale * p.y() + k_.cy};
    if (!std::isfinite(pixel.x()) || !std::isfinite(pixel.y())) return std::nullopt;
    return pixel;
  }
  /// The pixel of the point, and its derivative with respect to the point. If there is no pixel, `jacobian` is
  /// unchanged.
  [[nodiscard]] std::optional<vec2> project(const vec3& p, matrix<2, 3>& jacobian) const {
    const auto pixel = project(p);
    if (!pixel) return pixel;
    const double r = std::hypot(p.x(), p.y());
    const double z = p.z();
    if (!(r > 1e-9 * z)) {  // on the axis, the model equals the pinhole model
      jacobian(0, 0) = k_.fx / z, jacobian(0, 1) = 0.0, jacobian(0, 2) = -k_.fx * p.x() / (z * z);
      jacobian(1, 0) = 0.0, jacobian(1, 1) = k_.fy / z, jacobian(1, 2) = -k_.fy * p.y() / (z * z);
      return pixel;
    }
    const auto [distorted, slope] = radial(std::atan2(r, z));
    const double norm2 = r * r + z * z;
    const double c = p.x() / r, s = p.y() / r;
    const double along = slope * z / norm2;  // d theta_d / d r
    const double across = distorted / r;
    const double by_z = -slope * r / norm2;
    jacobian(0, 0) = k_.fx * (along * c * c + across * s * s);
    jacobian(0, 1) = k_.fx * (along - across) * c * s;
    jacobian(0, 2) = k_.fx * by_z * c;
    jacobian(1, 0) = k_.fy * (along - across) * c * s;
    jacobian(1, 1) = k_.fy * (along * s * s + across * c * c);
    jacobian(1, 2) = k_.fy * by_z * s;
    return pixel;
  }
  /// The ray through a pixel, scaled to z = 1, computed by Newton's method on the angle. Empty outside the domain, and
  /// for NaN.
  [[nodiscard]] std::optional<vec3> unproject(const vec2& pixel) const {
    const vec2 target{(pixel.x() - k_.cx) / k_.fx, (pixel.y() - k_.cy) / k_.fy};
    const double distorted = std::sqrt(target.x() * target.x() + target.y() * target.y());
    if (distorted == 0.0) return vec3{0.0, 0.0, 1.0};
    const auto theta = detail::invert_growing([this](double t) { return radial(t); }, distorted, max_angle_);
    if (!theta || !(*theta < max_angle_)) return std::nullopt;
    const double scale = std::tan(*theta) / distorted;
    return vec3{target.x() * scale, target.y() * scale, 1.0};
  }

  friend bool operator==(const kannala_brandt&, const kannala_brandt&) = default;

 private:
  static constexpr double right_angle = std::numbers::pi / 2.0;

  /// The distorted angle and its derivative.
  [[nodiscard]] std::pair<double, double> radial(double theta) const noexcept {
    const double s = theta * theta;
    return {theta * (1.0 + s * (d_.k1 + s * (d_.k2 + s * (d_.k3 + s * d_.k4)))),
            1.0 + s * (3.0 * d_.k1 + s * (5.0 * d_.k2 + s * (7.0 * d_.k3 + s * 9.0 * d_.k4)))};
  }

  [[nodiscard]] static double domain(const coefficients& d) {
    const std::array<double, 5> slope{1.0, 3.0 * d.k1, 5.0 * d.k2, 7.0 * d.k3, 9.0 * d.k4};
    return std::min(right_angle, std::sqrt(detail::smallest_positive_root(slope)));
  }

  intrinsics k_;
  coefficients d_;
  double max_angle_ = right_angle;
};

}  // namespace orbis::camera

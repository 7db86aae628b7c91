// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The pinhole camera: no distortion.
#pragma once

#include <cassert>
#include <cmath>
#include <optional>

#include <orbis/camera/intrinsics.hpp>
#include <orbis/core/types.hpp>

namespace orbis::camera {

/// The pinhole model: `u = fx x / z + cx`, `v = fy y / z + cy`. Satisfies `camera_model`.
class pinhole {
 public:
  pinhole() = default;
  /// @pre is_valid(k)
  explicit pinhole(const intrinsics& k) : k_{k} { assert(is_valid(k)); }
  pinhole(int width, int height, double fx, double fy, double cx, double cy)
      : pinhole(intrinsics{width, height, fx, fy, cx, cy}) {}

  [[nodiscard]] int width() const noexcept { return k_.width; }
  [[nodiscard]] int height() const noexcept { return k_.height; }
  /// Image size and camera matrix.
  [[nodiscard]] const intrinsics& k() const noexcept { return k_; }

  /// The pixel of a point in the camera frame (metres); empty for z <= 0, and for NaN.
  [[nodiscard]] std::optional<vec2> project(const vec3& p) const {
    if (!(p.z() > 0.0)) return std::nullopt;
    const vec2 pixel{k_.fx * (p.x() / p.z()) + k_.cx, k_.fy * (p.y() / p.z()) + k_.cy};
    if (!std::isfinite(pixel.x()) || !std::isfinite(pixel.y())) return std::nullopt;
    return pixel;
  }
  /// The pixel of the point, and its derivative with respect to the point. If there is no pixel, `jacobian` is
  /// unchanged.
  [[nodiscard]] std::optional<vec2> project(const vec3& p, matrix<2, 3>& jacobian) const {
    const auto pixel = project(p);
    if (pixel) {
      const double inverse_z = 1.0 / p.z();
      jacobian(0, 0) = k_.fx * inverse_z, jacobian(0, 1) = 0.0;
      jacobian(0, 2) = -k_.fx * p.x() * inverse_z * inverse_z;
      jacobian(1, 0) = 0.0, jacobian(1, 1) = k_.fy * inverse_z;
      jacobian(1, 2) = -k_.fy * p.y() * inverse_z * inverse_z;
    }
    return pixel;
  }
  /// The ray through a pixel, scaled to z = 1; empty for NaN and infinity.
  [[nodiscard]] std::optional<vec3> unproject(const vec2& pixel) const {
    if (!std::isfinite(pixel.x()) || !std::isfinite(pixel.y())) return std::nullopt;
    return vec3{(pixel.x() - k_.cx) / k_.fx, (pixel.y() - k_.cy) / k_.fy, 1.0};
  }

  friend bool operator==(const pinhole&, const pinhole&) = default;

 private:
  intrinsics k_;
};

}  // namespace orbis::camera

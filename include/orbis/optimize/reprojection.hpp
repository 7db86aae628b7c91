// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The reprojection residual of one observation, for any camera model, in two or three dimensions.
#pragma once

#include <cmath>
#include <limits>
#include <optional>

#include <orbis/camera/model.hpp>
#include <orbis/core/se3.hpp>

namespace orbis::optimize {

/// One known point, seen in an image.
struct pose_observation {
  vec3 point = vec3::Zero();  ///< in the world, metres
  vec2 pixel = vec2::Zero();
  /// The virtual right coordinate `u - bf / depth` of an RGB-D or stereo camera; NaN where the depth
  /// is not known.
  double right = std::numeric_limits<double>::quiet_NaN();
  double information = 1.0;  ///< 1 / sigma^2 of the pixel, 1 / pixel^2
  [[nodiscard]] bool has_depth() const noexcept { return !std::isnan(right); }
};

/// Projected minus observed: pixels, and with depth a third coordinate `u - bf / z` that a camera
/// displaced by the baseline would see. In that unit the error of a disparity-based depth sensor is
/// about constant, as that of the pixel is.
/// Source of the parametrisation: R. Mur-Artal, J. D. Tardos, "ORB-SLAM2", T-RO 33 (2017).
template <camera::camera_model Camera>
struct reprojection {
  Camera camera;
  double bf = 40.0;  ///< baseline times focal length, pixel metres

  /// The virtual right coordinate of a pixel at `depth` metres.
  [[nodiscard]] double right(double u, double depth) const noexcept { return u - bf / depth; }

  /// The residual at a point in the camera frame: the first two entries, and the third where the
  /// observation has depth (0 where not). Empty where the point has no projection.
  [[nodiscard]] std::optional<vec3> residual(const vec3& point_camera, const pose_observation& o) const {
    const auto pixel = camera.project(point_camera);
    if (!pixel) return std::nullopt;
    return difference(*pixel, point_camera.z(), o);
  }

  /// The same with its derivative by the point in the camera frame; the third row is 0 without depth.
  [[nodiscard]] std::optional<vec3> residual(const vec3& point_camera, const pose_observation& o, mat3& j) const {
    matrix<2, 3> projection;
    const auto pixel = camera.project(point_camera, projection);
    if (!pixel) return std::nullopt;
    j.template topRows<2>() = projection;
    j.row(2).setZero();
    if (o.has_depth()) {
      j.row(2) = projection.row(0);
      j(2, 2) += bf / (point_camera.z() * point_camera.z());
    }
    return difference(*pixel, point_camera.z(), o);
  }

 private:
  [[nodiscard]] vec3 difference(const vec2& pixel, double z, const pose_observation& o) const {
    return {pixel.x() - o.pixel.x(), pixel.y() - o.pixel.y(), o.has_depth() ? right(pixel.x(), z) - o.right : 0.0};
  }
};

template <class Camera>
reprojection(Camera, double) -> reprojection<Camera>;
template <class Camera>
reprojection(Camera) -> reprojection<Camera>;

}  // namespace orbis::optimize

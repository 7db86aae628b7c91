// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The distance between a measured point and a plane: the residual of a depth measurement.
///
/// Source: Y. Chen, G. Medioni, "Object modelling by registration of multiple range images", Image and
/// Vision Computing 10(3), 1992.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>

#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/bundle_problem.hpp>

namespace orbis::optimize {

/// A point, measured in the camera frame, on a plane in the world frame. The whitened residual of the pose
/// `T_world_camera` is `sqrt(information) * n . (T_world_camera * q - p)`. Use it only if `is_usable()`.
struct point_to_plane {
  using point = se3;
  static constexpr int dimension = 1;

  vec3 measured = zeros<vec3>();      ///< q, in the camera frame, metres
  vec3 on_plane = zeros<vec3>();      ///< p, in the world frame, metres
  vec3 normal = vec3(0.0, 0.0, 1.0);  ///< n, in the world frame, of unit length
  double information = 1.0;           ///< 1 / sigma^2 along the normal, in 1 / m^2

  [[nodiscard]] bool is_usable() const {
    return all_finite(measured) && all_finite(on_plane) && std::abs(squared_norm(normal) - 1.0) < 1e-6 &&
           information > 0.0 && std::isfinite(information);
  }
  /// Returns the residual; empty if it is not finite.
  [[nodiscard]] std::optional<matrix<1>> residual(const se3& T_world_camera) const {
    const vec3 off = T_world_camera * measured - on_plane;
    const matrix<1> r(std::sqrt(information) * dot(normal, off));
    if (!std::isfinite(r[0])) return std::nullopt;
    return r;
  }
  /// Returns the residual and writes its derivative with respect to a step `T_world_camera * exp(d)`; if the residual
  /// is empty, the derivative is not written.
  [[nodiscard]] std::optional<matrix<1>> linearize(const se3& T_world_camera, matrix<1, 6>& jacobian) const {
    const auto r = residual(T_world_camera);
    if (!r) return r;
    vec3 turned = T_world_camera.rotation().inverse() * normal;
    turned *= std::sqrt(information);
    const vec3 lever = cross(measured, turned);
    for (int k = 0; k != 3; ++k) {
      jacobian[k] = turned[k];
      jacobian[3 + k] = lever[k];
    }
    return r;
  }
};

/// A depth measurement, made by the camera with index `pose`, of the plane through the point with index `point`; both
/// indices refer to the caller's arrays.
struct plane_observation {
  std::uint32_t pose = 0;
  std::uint32_t point = 0;
  vec3 measured = zeros<vec3>();      ///< in the camera frame, metres
  vec3 normal = vec3(0.0, 0.0, 1.0);  ///< unit normal of the plane, in the world frame
  double information = 1.0;           ///< 1 / sigma^2 along the normal, in 1 / m^2
};

/// The point-to-plane residual for bundle adjustment: estimates a point on the plane; the normal is fixed. Only the
/// position of that point along the normal is determined. Satisfies `bundle_residual`.
struct point_to_plane_adjustment {
  using camera_state = se3;
  using camera_manifold = lie_group<se3>;
  using observation = plane_observation;
  static constexpr int dimension = 1;
  struct view {
    mat3 rotation;  ///< from the camera to the world
    vec3 translation;
  };

  [[nodiscard]] static view prepare(const se3& T_world_camera) {
    return {T_world_camera.rotation_matrix(), T_world_camera.translation()};
  }
  [[nodiscard]] static bool is_usable(const observation& o) {
    return o.information > 0.0 && std::isfinite(o.information) && all_finite(o.measured) &&
           std::abs(squared_norm(o.normal) - 1.0) < 1e-6;
  }
  [[nodiscard]] static std::optional<matrix<1>> residual(const view& v, const vec3& point, const observation& o) {
    vec3 off = v.rotation * o.measured;
    off += v.translation;
    off -= point;
    const matrix<1> r(dot(o.normal, off));
    if (!std::isfinite(r[0])) return std::nullopt;
    return r;
  }
  [[nodiscard]] static std::optional<matrix<1>> linearize(const view& v, const vec3& point, const observation& o,
                                                          matrix<1, 6>& by_camera, matrix<1, 3>& by_point) {
    const auto r = residual(v, point, o);
    if (!r) return r;
    const vec3 turned = transposed(v.rotation) * o.normal;
    const vec3 lever = cross(o.measured, turned);
    for (int k = 0; k != 3; ++k) {
      by_camera[k] = turned[k];
      by_camera[3 + k] = lever[k];
      by_point[k] = -o.normal[k];
    }
    return r;
  }
};

}  // namespace orbis::optimize

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The reprojection residual of one observation, for any camera model, in two or three dimensions.
#pragma once

#include <cmath>
#include <concepts>
#include <limits>
#include <optional>

#include <orbis/camera/project_lanes.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/core/lanes.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/optimize/bundle_summary.hpp>
#include <orbis/optimize/manifold.hpp>
#include <orbis/optimize/residual.hpp>

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

/// A pose as the residuals of bundle adjustment want it: world to camera.
struct camera_view {
  mat3 rotation = mat3::Identity();
  vec3 translation = vec3::Zero();
};

/// Projected minus observed: pixels, and with depth a third coordinate `u - bf / z` that a camera
/// displaced by the baseline would see. In that unit the error of a disparity-based depth sensor is
/// about constant, as that of the pixel is.
/// Source of the parametrisation: R. Mur-Artal, J. D. Tardos, "ORB-SLAM2", T-RO 33 (2017).
/// Satisfies `camera_frame_residual`: what bundle adjustment estimates for a camera is its pose
/// `T_world_camera`.
template <camera::camera_model Camera>
struct reprojection {
  Camera camera;
  double bf = 40.0;  ///< baseline times focal length, pixel metres

  using camera_state = se3;
  using camera_manifold = lie_group<se3>;
  using observation = bundle_observation;
  using view = camera_view;
  static constexpr int dimension = 3;
  static constexpr int intrinsic_dimension = 0;

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

  [[nodiscard]] static view prepare(const se3& T_world_camera) {
    const se3 inverse = T_world_camera.inverse();
    return {inverse.rotation_matrix(), inverse.translation()};
  }
  [[nodiscard]] static bool is_usable(const observation& o) {
    return o.information > 0.0 && std::isfinite(o.information) && o.pixel.allFinite() && !std::isinf(o.right);
  }
  [[nodiscard]] std::optional<vec3> residual(const view& v, const vec3& point, const observation& o) const {
    return residual_in_camera(v, v.rotation * point + v.translation, o);
  }
  [[nodiscard]] std::optional<vec3> linearize(const view& v, const vec3& point, const observation& o,
                                              matrix<3, 6>& by_camera, mat3& by_point) const {
    return detail::linearize_through_camera(*this, v, point, o, by_camera, by_point);
  }
  [[nodiscard]] std::optional<vec3> residual_in_camera(const view&, const vec3& q, const observation& o) const {
    return residual(q, as_pose_observation(o));
  }
  [[nodiscard]] std::optional<vec3> linearize_in_camera(const view&, const vec3& q, const observation& o, mat3& by_q,
                                                        matrix<3, 0>&) const {
    return residual(q, as_pose_observation(o), by_q);
  }

  /// Eight observations at once; see `detail::lane_residual`.
  static constexpr int measured = 4;
  static void measure(const observation& o, double* to) {
    to[0] = o.pixel.x();
    to[8] = o.pixel.y();
    to[16] = std::isnan(o.right) ? 0.0 : o.right;
    to[24] = std::isnan(o.right) ? 0.0 : 1.0;
  }
  template <bool Derive, simd::lane_vector L>
  ORBIS_ALWAYS_INLINE typename L::mask lanes_in_camera(const view&, const double* measurements, const L* q, L* r,
                                                       L (*by_q)[3], L (*)[1]) const {
    camera::lane_projection<L> p;
    camera::lanes_of<Camera>::template project<Derive>(camera, q[0], q[1], q[2], p);
    const L has_depth = L::load(measurements + 24), inverse_z = 1.0 / q[2];
    const L shift = bf * inverse_z;
    r[0] = p.u - L::load(measurements);
    r[1] = p.v - L::load(measurements + 8);
    r[2] = has_depth * ((p.u - shift) - L::load(measurements + 16));
    if constexpr (Derive) {
      for (int i = 0; i != 3; ++i) {
        by_q[0][i] = p.j[0][i];
        by_q[1][i] = p.j[1][i];
        by_q[2][i] = has_depth * (i == 2 ? p.j[0][2] + shift * inverse_z : p.j[0][i]);
      }
    }
    return p.valid;
  }

 private:
  [[nodiscard]] static pose_observation as_pose_observation(const observation& o) {
    return {vec3::Zero(), o.pixel, o.right, o.information};
  }
  [[nodiscard]] vec3 difference(const vec2& pixel, double z, const pose_observation& o) const {
    return {pixel.x() - o.pixel.x(), pixel.y() - o.pixel.y(), o.has_depth() ? right(pixel.x(), z) - o.right : 0.0};
  }
};

namespace detail {

/// A `camera_frame_residual` that can do eight observations of one camera at once. `measure(o, to)`
/// writes what it needs of an observation to `to[8 * i]`, i < `R::measured`;
/// `lanes_in_camera<Derive>(view, measurements, q, r, by_q, by_intrinsics)` is `linearize_in_camera`
/// (without `Derive`: `residual_in_camera`) on all of them, and returns where there is a projection.
template <class R>
concept lane_residual = camera_frame_residual<R> &&
    requires(const R& r, const typename R::observation& o, const typename R::view& view, double* to,
             simd::lanes<2>* lanes, simd::lanes<2> (*by_q)[3],
             simd::lanes<2> (*by_intrinsics)[R::intrinsic_dimension == 0 ? 1 : R::intrinsic_dimension]) {
  {r.measure(o, to)};
  {
    r.template lanes_in_camera<true>(view, to, lanes, lanes, by_q, by_intrinsics)
    } -> std::same_as<simd::lanes<2>::mask>;
};

}  // namespace detail

template <class Camera>
reprojection(Camera, double) -> reprojection<Camera>;
template <class Camera>
reprojection(Camera) -> reprojection<Camera>;

}  // namespace orbis::optimize

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The reprojection error of an observation, for any camera model: in the image and, with depth, in a virtual right
/// image.
#pragma once

#include <cmath>
#include <concepts>
#include <limits>
#include <optional>

#include <orbis/camera/model.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/bundle_problem.hpp>
#include <orbis/optimize/detail/bundle/through_camera.hpp>

namespace orbis::optimize {

/// Observation of a known point in one image.
struct pose_observation {
  vec3 point = zeros<vec3>();  ///< in the world frame, metres
  vec2 pixel = zeros<vec2>();
  /// The virtual right coordinate `u - bf / depth` of an RGB-D or stereo camera, pixels; NaN if the depth is unknown.
  double right = std::numeric_limits<double>::quiet_NaN();
  double information = 1.0;  ///< 1 / sigma^2 of the pixel, in 1 / pixel^2
  /// Weight of the third residual: sigma of the pixel divided by sigma of the right coordinate; finite and not
  /// negative.
  double depth_weight = 1.0;
  /// Additional error of the pixel along a line, finite, for example due to motion blur: the direction of the line,
  /// with the standard deviation divided by sigma of the pixel as its length. The covariance of the pixel is `(I + s
  /// s^T) / information`, and that of the depth is unchanged.
  vec2 smear = zeros<vec2>();
  [[nodiscard]] bool has_depth() const noexcept { return !std::isnan(right); }
};

/// The part of an observation from which `reprojection` computes its residual, as in a `pose_observation` or a
/// `bundle_observation`.
template <class O>
concept observed_pixel = requires(const O& o) {
  { o.pixel } -> std::convertible_to<vec2>;
  { o.right } -> std::convertible_to<double>;
  { o.has_depth() } -> std::same_as<bool>;
  { o.depth_weight } -> std::convertible_to<double>;
  { o.smear } -> std::convertible_to<vec2>;
};

namespace detail {

/// Returns `w` such that `I - w w^T` is the inverse square root of `I + smear smear^T`.
[[nodiscard]] inline vec2 whitening(const vec2& smear) {
  const double squared = squared_norm(smear);
  if (squared == 0.0) return zeros<vec2>();
  return std::sqrt((1.0 - 1.0 / std::sqrt(1.0 + squared)) / squared) * smear;
}

}  // namespace detail

/// Returns a `pose_observation` or `bundle_observation` with its largest standard deviation in all directions. The
/// standard deviation of the depth is unchanged. For methods that ignore the smear, and whose depth residual does not
/// depend on the pixel.
template <class Observation>
[[nodiscard]] Observation without_smear(Observation o) {
  const double largest = 1.0 + squared_norm(o.smear);
  o.information /= largest;
  o.depth_weight *= std::sqrt(largest);
  o.smear = zeros<vec2>();
  return o;
}

/// A pose in the form used by residuals: the transform from the world to the camera frame.
struct camera_view {
  mat3 rotation = identity<mat3>();
  vec3 translation = zeros<vec3>();
};

/// The reprojection error, projected minus observed, in pixels: two coordinates and, with depth, a third: `u - bf / z`,
/// the column in a camera displaced by the baseline. In terms of this column, the error of a disparity-based depth
/// sensor is nearly constant, like that of the pixel. Along `pose_observation::smear`, the error of the pixel is
/// divided by its larger standard deviation, also in the third coordinate. Satisfies `camera_frame_residual`; the
/// estimated camera state is the pose `T_world_camera`. Source: R. Mur-Artal, J. D. Tardos, "ORB-SLAM2", T-RO 33
/// (2017).
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

  /// Returns the virtual right coordinate of a pixel in column `u` at `depth` metres.
  [[nodiscard]] double right(double u, double depth) const noexcept { return u - bf / depth; }

  /// Returns the residual for a point in the camera frame; empty if it has no projection. Without depth, the third
  /// entry is 0.
  template <observed_pixel Observation = pose_observation>
  [[nodiscard]] std::optional<vec3> residual(const vec3& point_camera, const Observation& o) const {
    const auto pixel = camera.project(point_camera);
    if (!pixel) return std::nullopt;
    return difference(*pixel, point_camera.z(), o, detail::whitening(o.smear));
  }

  /// Like the overload without `j`; also writes the derivative with respect to the point in the camera frame to `j`.
  /// Without depth, its third row is 0.
  template <observed_pixel Observation = pose_observation>
  [[nodiscard]] std::optional<vec3> residual(const vec3& point_camera, const Observation& o, mat3& j) const {
    matrix<2, 3> projection;
    const auto pixel = camera.project(point_camera, projection);
    if (!pixel) return std::nullopt;
    const vec2 w = detail::whitening(o.smear);
    projection -= w * (transposed(w) * projection);
    set_block(j, 0, 0, projection);
    for (int i = 0; i != 3; ++i) j(2, i) = 0.0;
    if (o.has_depth()) {
      for (int i = 0; i != 3; ++i) j(2, i) = o.depth_weight * projection(0, i);
      j(2, 2) += o.depth_weight * bf / (point_camera.z() * point_camera.z());
    }
    return difference(*pixel, point_camera.z(), o, w);
  }

  // The interface of `bundle_residual` and `camera_frame_residual`.
  [[nodiscard]] static view prepare(const se3& T_world_camera) {
    const se3 inverse = T_world_camera.inverse();
    return {inverse.rotation_matrix(), inverse.translation()};
  }
  [[nodiscard]] static bool is_usable(const observation& o) {
    return o.information > 0.0 && std::isfinite(o.information) && all_finite(o.pixel) && all_finite(o.smear) &&
           !std::isinf(o.right);
  }
  [[nodiscard]] std::optional<vec3> residual(const view& v, const vec3& point, const observation& o) const {
    return residual_in_camera(v, v.rotation * point + v.translation, o);
  }
  [[nodiscard]] std::optional<vec3> linearize(const view& v, const vec3& point, const observation& o,
                                              matrix<3, 6>& by_camera, mat3& by_point) const {
    return detail::linearize_through_camera(*this, v, point, o, by_camera, by_point);
  }
  [[nodiscard]] std::optional<vec3> residual_in_camera(const view&, const vec3& q, const observation& o) const {
    return residual(q, o);
  }
  [[nodiscard]] std::optional<vec3> linearize_in_camera(const view&, const vec3& q, const observation& o, mat3& by_q,
                                                        matrix<3, 0>&) const {
    return residual(q, o, by_q);
  }

  // Evaluation of eight observations at a time; see detail/bundle/lane_residual.hpp.
  static constexpr int measured = 6;
  template <observed_pixel Observation = observation>
  static void measure(const Observation& o, double* to) {
    to[0] = o.pixel.x();
    to[8] = o.pixel.y();
    to[16] = o.has_depth() ? o.right : 0.0;
    to[24] = o.has_depth() ? o.depth_weight : 0.0;
    const vec2 w = detail::whitening(o.smear);
    to[32] = w.x();
    to[40] = w.y();
  }
  template <bool Derive, class L>
  auto lanes_in_camera(const view&, const double* measurements, const L* q, L* r, L (*by_q)[3], L (*)[1]) const;

 private:
  /// `w`: `detail::whitening` of the smear.
  template <observed_pixel Observation>
  [[nodiscard]] vec3 difference(const vec2& pixel, double z, const Observation& o, const vec2& w) const {
    const vec2 error = pixel - o.pixel;
    const double along = dot(w, error);
    return {error.x() - along * w.x(), error.y() - along * w.y(),
            o.has_depth() ? o.depth_weight * (right(pixel.x(), z) - o.right - along * w.x()) : 0.0};
  }
};

template <class Camera>
reprojection(Camera, double) -> reprojection<Camera>;
template <class Camera>
reprojection(Camera) -> reprojection<Camera>;

}  // namespace orbis::optimize

#ifndef ORBIS_COMPILED
#include <orbis/optimize/reprojection-inl.hpp>
#endif

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Reprojection errors of cameras whose intrinsic parameters are estimated together with their poses: for any
/// parametric camera model, and for the model of "Bundle adjustment in the large".
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <utility>

#include <orbis/camera/parameters.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/bundle_problem.hpp>
#include <orbis/optimize/detail/bundle/through_camera.hpp>
#include <orbis/optimize/reprojection.hpp>

namespace orbis::optimize {

/// The pose and the camera model of an image.
template <camera::parametric_camera Camera>
struct posed_camera {
  se3 T_world_camera;
  Camera camera;
};

namespace detail {

/// The indices of the estimated parameters; all if `Free` is empty.
template <class Camera, int... Free>
inline constexpr auto estimated_parameters = [] {
  constexpr int count = camera::parameters_of<Camera>::count;
  std::array<int, sizeof...(Free) == 0 ? static_cast<std::size_t>(count) : sizeof...(Free)> which{Free...};
  if constexpr (sizeof...(Free) == 0)
    for (int i = 0; i != count; ++i) which[static_cast<std::size_t>(i)] = i;
  return which;
}();

/// Returns true if the indices are in range and ascending.
template <class Camera, int... Free>
[[nodiscard]] consteval bool names_parameters() {
  int last = -1;
  for (const int i : estimated_parameters<Camera, Free...>) {
    if (i <= last || i >= camera::parameters_of<Camera>::count) return false;
    last = i;
  }
  return true;
}

}  // namespace detail

/// The manifold of a posed camera: the first six entries of a step move the pose in its own frame, `T_world_camera *
/// exp(d)`; the others are added to the estimated parameters (in the order of `camera::parameters_of`; all if `Free` is
/// empty). If the new parameters are invalid, such as a negative focal length, the parameter step is halved until they
/// are valid.
template <camera::parametric_camera Camera, int... Free>
struct posed_camera_manifold {
  static_assert(detail::names_parameters<Camera, Free...>(),
                "the estimated parameters must be valid indices in ascending order");
  using point = posed_camera<Camera>;
  static constexpr auto free = detail::estimated_parameters<Camera, Free...>;
  static constexpr int dimension = 6 + static_cast<int>(free.size());
  using tangent = matrix<dimension>;

  [[nodiscard]] static point retract(const point& p, const tangent& d) {
    using parameters = camera::parameters_of<Camera>;
    constexpr int most_halvings = 60;
    const vec6 move = head<6>(d);
    const auto from = parameters::get(p.camera);
    double share = 1.0;
    for (int k = 0; k != most_halvings; ++k, share *= 0.5) {
      auto to = from;
      for (std::size_t i = 0; i != free.size(); ++i) to[free[i]] += share * d[6 + static_cast<int>(i)];
      if (auto camera = parameters::with(p.camera, to)) return {p.T_world_camera * se3::exp(move), *std::move(camera)};
    }
    return {p.T_world_camera * se3::exp(move), p.camera};
  }
};

/// The reprojection error of `reprojection`, with the intrinsic parameters of every camera among the unknowns: the
/// estimated state of a camera is a `posed_camera<Camera>`. Satisfies `camera_frame_residual`.
///
/// @code
///   using model = reprojection_with_intrinsics<camera::radial_tangential, 0, 1, 4, 5>;  // fx, fy, k1, k2
///   bundle_adjuster ba{model{}, huber{2.45}};
///   ba.solve(seq, cameras, points, observations);  // cameras: a span of model::camera_state
/// @endcode
///
/// The template arguments are the indices of the estimated parameters, in the order of `camera::parameters_of<Camera>`;
/// the others keep their values. Without indices, all are estimated. For `radial_tangential`, estimate only some,
/// because the numerator and the denominator of its distortion are correlated.
///
/// Each camera has its own intrinsics, as for photographs of unknown origin; several cameras cannot share them.
/// `bundle_options::fixed_poses` fixes the intrinsics of a camera together with its pose. For images from one known
/// camera, use `reprojection`.
///
/// `bundle_observation::depth_weight` and `smear` are ignored.
///
/// `bf` must be the value with which `bundle_observation::right` was computed. It stays constant, which is correct for
/// sensors that measure depth, but not for a stereo pair whose focal length is estimated.
template <camera::parametric_camera Camera, int... Free>
struct reprojection_with_intrinsics {
  double bf = 40.0;  ///< baseline times focal length, pixel metres

  using camera_state = posed_camera<Camera>;
  using camera_manifold = posed_camera_manifold<Camera, Free...>;
  using observation = bundle_observation;
  struct view : camera_view {
    Camera camera{};
  };
  static constexpr int dimension = 3;
  static constexpr int intrinsic_dimension = camera_manifold::dimension - 6;

  /// Returns the virtual right coordinate of a pixel in column `u` at `depth` metres.
  [[nodiscard]] double right(double u, double depth) const noexcept { return u - bf / depth; }

  [[nodiscard]] static view prepare(const camera_state& c) {
    const se3 inverse = c.T_world_camera.inverse();
    return {{inverse.rotation_matrix(), inverse.translation()}, c.camera};
  }
  [[nodiscard]] static bool is_usable(const observation& o) { return reprojection<Camera>::is_usable(o); }
  [[nodiscard]] std::optional<vec3> residual(const view& v, const vec3& point, const observation& o) const {
    return residual_in_camera(v, v.rotation * point + v.translation, o);
  }
  [[nodiscard]] std::optional<vec3> linearize(const view& v, const vec3& point, const observation& o,
                                              matrix<3, camera_manifold::dimension>& by_camera, mat3& by_point) const {
    return detail::linearize_through_camera(*this, v, point, o, by_camera, by_point);
  }
  [[nodiscard]] std::optional<vec3> residual_in_camera(const view& v, const vec3& q, const observation& o) const {
    const auto pixel = v.camera.project(q);
    if (!pixel) return std::nullopt;
    return difference(*pixel, q.z(), o);
  }
  [[nodiscard]] std::optional<vec3> linearize_in_camera(const view& v, const vec3& q, const observation& o, mat3& by_q,
                                                        matrix<3, intrinsic_dimension>& by_intrinsics) const {
    using parameters = camera::parameters_of<Camera>;
    matrix<2, 3> by_point;
    matrix<2, parameters::count> by_parameters;
    const auto pixel = parameters::project(v.camera, q, by_point, by_parameters);
    if (!pixel) return std::nullopt;
    const bool has_depth = o.has_depth();
    for (int i = 0; i != 3; ++i) {
      by_q(0, i) = by_point(0, i);
      by_q(1, i) = by_point(1, i);
      by_q(2, i) = has_depth ? by_point(0, i) : 0.0;
    }
    if (has_depth) by_q(2, 2) += bf / (q.z() * q.z());
    for (int i = 0; i != intrinsic_dimension; ++i) {
      const int from = camera_manifold::free[static_cast<std::size_t>(i)];
      by_intrinsics(0, i) = by_parameters(0, from);
      by_intrinsics(1, i) = by_parameters(1, from);
      by_intrinsics(2, i) = has_depth ? by_parameters(0, from) : 0.0;
    }
    return difference(*pixel, q.z(), o);
  }

 private:
  [[nodiscard]] vec3 difference(const vec2& pixel, double z, const observation& o) const {
    return {pixel.x() - o.pixel.x(), pixel.y() - o.pixel.y(), o.has_depth() ? right(pixel.x(), z) - o.right : 0.0};
  }
};

/// The camera of "Bundle adjustment in the large": a pose, a focal length and two radial distortion coefficients. With
/// p = R X + t, the pixel of a point is `-f (1 + k1 r^2 + k2 r^4) (p.x, p.y) / p.z`, where r^2 = (p.x^2 + p.y^2) /
/// p.z^2, relative to the image centre, with x to the right and y up: the camera looks along -z. Source: S. Agarwal, N.
/// Snavely, S. M. Seitz, R. Szeliski, "Bundle adjustment in the large", ECCV 2010.
struct bal_camera {
  se3 T_camera_world;
  double focal = 1.0;  ///< pixels
  double k1 = 0.0, k2 = 0.0;

  /// Creates a camera from rotation vector, translation, focal length, k1 and k2, as in the files of the data set.
  [[nodiscard]] static bal_camera from_parameters(std::span<const double, 9> p) {
    return {se3{so3::exp(vec3{p[0], p[1], p[2]}), vec3{p[3], p[4], p[5]}}, p[6], p[7], p[8]};
  }
  [[nodiscard]] std::array<double, 9> parameters() const {
    const vec3 r = T_camera_world.rotation().log();
    const vec3& t = T_camera_world.translation();
    return {r.x(), r.y(), r.z(), t.x(), t.y(), t.z(), focal, k1, k2};
  }
};

/// The manifold of a `bal_camera`: the first six entries of a step move the pose in the camera's own frame; the others
/// are added to the focal length, k1 and k2.
struct bal_manifold {
  using point = bal_camera;
  using tangent = matrix<9>;
  static constexpr int dimension = 9;

  [[nodiscard]] static point retract(const point& p, const tangent& d) {
    vec6 back;
    for (int i = 0; i != 6; ++i) back[i] = -d[i];
    return {se3::exp(back) * p.T_camera_world, p.focal + d[6], p.k1 + d[7], p.k2 + d[8]};
  }
};

struct bal_view : camera_view {
  double focal = 1.0, k1 = 0.0, k2 = 0.0;
};

/// The reprojection error of a `bal_camera`, projected minus observed, pixels. Ignores the observations' `right`. The
/// formula is also applied to points behind the camera. Satisfies `camera_frame_residual`.
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
  [[nodiscard]] static std::optional<vec2> linearize(const view& v, const vec3& point, const observation& o,
                                                     matrix<2, 9>& by_camera, matrix<2, 3>& by_point) {
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

  // Evaluation of eight observations at a time; see detail/bundle/lane_residual.hpp.
  static constexpr int measured = 2;
  static void measure(const observation& o, double* to) {
    to[0] = o.pixel.x();
    to[8] = o.pixel.y();
  }
  template <bool Derive, class L>
  auto lanes_in_camera(const view& c, const double* measurements, const L* q, L* r, L (*by_q)[3],
                       L (*by_intrinsics)[3]) const;
};

}  // namespace orbis::optimize

#ifndef ORBIS_COMPILED
#include <orbis/optimize/reprojection_with_intrinsics-inl.hpp>
#endif

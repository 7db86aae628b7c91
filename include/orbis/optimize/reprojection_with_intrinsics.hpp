// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The reprojection residual of a camera whose intrinsic parameters are estimated along with its pose.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include <orbis/camera/parameters.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/bundle_summary.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/residual.hpp>

namespace orbis::optimize {

/// A pose and the camera that took the image there.
template <camera::parametric_camera Camera>
struct posed_camera {
  se3 T_world_camera;
  Camera camera;
};

namespace detail {

/// Which of a camera's parameters are estimated; all where none is named.
template <class Camera, int... Free>
inline constexpr auto estimated_parameters = [] {
  constexpr int count = camera::parameters_of<Camera>::count;
  std::array<int, sizeof...(Free) == 0 ? static_cast<std::size_t>(count) : sizeof...(Free)> which{Free...};
  if constexpr (sizeof...(Free) == 0)
    for (int i = 0; i != count; ++i) which[static_cast<std::size_t>(i)] = i;
  return which;
}();

/// Within the range and ascending, so none twice.
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

/// A step moves the pose in its own frame, as `T_world_camera * exp(d)`, then adds to the parameters named
/// (in the order of `camera::parameters_of`; to all where none is). A step to parameters of which there is no
/// camera, such as a focal length below 0, is halved as far as the parameters go until there is one.
template <camera::parametric_camera Camera, int... Free>
struct posed_camera_manifold {
  static_assert(detail::names_parameters<Camera, Free...>(),
                "the parameters to be estimated: numbers that the camera has, ascending");
  using point = posed_camera<Camera>;
  static constexpr auto free = detail::estimated_parameters<Camera, Free...>;
  static constexpr int dimension = 6 + static_cast<int>(free.size());
  using tangent = matrix<dimension>;

  [[nodiscard]] static point retract(const point& p, const tangent& d) {
    using parameters = camera::parameters_of<Camera>;
    constexpr int most_halvings = 60;
    const vec6 move = d.template head<6>();
    const auto from = parameters::get(p.camera);
    double share = 1.0;
    for (int k = 0; k != most_halvings; ++k, share *= 0.5) {
      auto to = from;
      for (std::size_t i = 0; i != free.size(); ++i) to[free[i]] += share * d[6 + static_cast<int>(i)];
      if (auto camera = parameters::with(p.camera, to)) return {p.T_world_camera * se3::exp(move), *std::move(camera)};
    }
    return {p.T_world_camera * se3::exp(move), p.camera};
  }
  [[nodiscard]] static tangent local(const point& p, const point& q) {
    using parameters = camera::parameters_of<Camera>;
    const vec6 move = (p.T_world_camera.inverse() * q.T_world_camera).log();
    const auto from = parameters::get(p.camera), to = parameters::get(q.camera);
    tangent d;
    d.template head<6>() = move;
    for (std::size_t i = 0; i != free.size(); ++i) d[6 + static_cast<int>(i)] = to[free[i]] - from[free[i]];
    return d;
  }
};

/// Projected minus observed as in `reprojection`, with the intrinsic parameters of every camera among the
/// unknowns: what bundle adjustment estimates for a camera is a `posed_camera<Camera>`.
///
/// @code
///   using model = reprojection_with_intrinsics<camera::radial_tangential, 0, 1, 4, 5>;  // fx, fy, k1, k2
///   bundle_adjuster ba{model{}, huber{2.45}};
///   ba.solve(seq, cameras, points, observations);  // cameras: a span of model::camera_state
/// @endcode
///
/// The numbers name the parameters that are estimated, in the order of `camera::parameters_of<Camera>`;
/// the others stay as they are in each camera. Without numbers all are estimated, which determines the
/// numerator and the denominator of `radial_tangential` only together: name fewer there.
///
/// Each camera has intrinsics of its own, as photographs of unknown origin have: bundle adjustment has no
/// block that several cameras share. `bundle_options::fixed_poses` holds a camera's intrinsics with its
/// pose. For images that one known camera took, `reprojection` is the residual.
///
/// `bf` is what depth was turned into `bundle_observation::right` with, and is held: right for sensors
/// that measure depth, where it is a matter of units, not for a stereo pair whose focal length is estimated.
/// Satisfies `camera_frame_residual`.
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

  /// The virtual right coordinate of a pixel at `depth` metres.
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
    const bool has_depth = !std::isnan(o.right);
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
    return {pixel.x() - o.pixel.x(), pixel.y() - o.pixel.y(),
            std::isnan(o.right) ? 0.0 : right(pixel.x(), z) - o.right};
  }
};

}  // namespace orbis::optimize

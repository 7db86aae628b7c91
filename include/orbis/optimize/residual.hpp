// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a residual of bundle adjustment is: how one observation of a point by a camera disagrees with
/// where both are estimated to be.
#pragma once

#include <concepts>
#include <cstdint>
#include <optional>

#include <orbis/core/types.hpp>
#include <orbis/optimize/manifold.hpp>

namespace orbis::optimize {

/// A manifold of any kind of points, whatever the number of rows its `reduce` is asked for.
template <class M>
concept camera_manifold = std::copyable<M> &&
    requires(const M& m, const typename M::point& p, const typename M::tangent& d) {
  { m.retract(p, d) } -> std::same_as<typename M::point>;
  requires std::same_as<typename M::tangent, matrix<M::dimension>>;
};

/// An observation names the camera `pose` and the `point` by their indices, and says by how much its
/// squared residual counts: `information`, 1 / sigma^2.
template <class O>
concept observation_of_a_point = std::copyable<O> && requires(const O& o) {
  { o.pose } -> std::convertible_to<std::uint32_t>;
  { o.point } -> std::convertible_to<std::uint32_t>;
  { o.information } -> std::convertible_to<double>;
};

/// - `R::camera_state` is what is estimated for each camera (a pose; a pose with intrinsics; ...), and
///   `R::camera_manifold` how steps move it;
/// - `r.prepare(state)` is everything that all observations by one camera share, an `R::view`: made
///   once for each linearisation, not once for each observation;
/// - `r.is_usable(o)`: whether an observation is worth looking at (finite, say);
/// - `r.residual(view, point, o)`: `R::dimension` numbers, not yet whitened, or empty where there is
///   no projection. `point` is in the world;
/// - `r.linearize(view, point, o, by_camera, by_point)`: the same with its derivatives by a step on
///   the manifold and by the point.
template <class R>
concept bundle_residual = std::copyable<R> && camera_manifold<typename R::camera_manifold> &&
    observation_of_a_point<typename R::observation> &&
    std::same_as<typename R::camera_manifold::point, typename R::camera_state> &&
    requires(const R& r, const typename R::camera_state& state, const typename R::view& view, const vec3& point,
             const typename R::observation& o, matrix<R::dimension, R::camera_manifold::dimension>& by_camera,
             matrix<R::dimension, 3>& by_point) {
  { r.prepare(state) } -> std::same_as<typename R::view>;
  { r.is_usable(o) } -> std::same_as<bool>;
  { r.residual(view, point, o) } -> std::same_as<std::optional<matrix<R::dimension>>>;
  { r.linearize(view, point, o, by_camera, by_point) } -> std::same_as<std::optional<matrix<R::dimension>>>;
};

/// A residual that sees the point only through its coordinates q in the camera frame, and whose camera
/// is a pose that steps in its own frame, as `T_world_camera * exp(d)`, followed by
/// `R::intrinsic_dimension` further parameters. All its derivatives are products of those by q with
/// R_camera_world and with (-I, hat(q)): with M = J^T W J made once for each observation this is half
/// the work. The view has `rotation` (R_camera_world) and `translation`.
template <class R>
concept camera_frame_residual =
    bundle_residual<R> && R::camera_manifold::dimension ==
    6 + R::intrinsic_dimension&& requires(const R& r, const typename R::view& view, const vec3& q,
                                          const typename R::observation& o, matrix<R::dimension, 3>& by_q,
                                          matrix<R::dimension, R::intrinsic_dimension>& by_intrinsics) {
  { view.rotation } -> std::convertible_to<mat3>;
  { view.translation } -> std::convertible_to<vec3>;
  { r.residual_in_camera(view, q, o) } -> std::same_as<std::optional<matrix<R::dimension>>>;
  { r.linearize_in_camera(view, q, o, by_q, by_intrinsics) } -> std::same_as<std::optional<matrix<R::dimension>>>;
};

namespace detail {

/// What `camera_frame_residual` leaves to derive: `linearize` from `linearize_in_camera`.
template <class R>
[[nodiscard]] std::optional<matrix<R::dimension>> linearize_through_camera(
    const R& residual, const typename R::view& view, const vec3& point, const typename R::observation& o,
    matrix<R::dimension, 6 + R::intrinsic_dimension>& by_camera, matrix<R::dimension, 3>& by_point) {
  const vec3 q = view.rotation * point + view.translation;
  matrix<R::dimension, 3> by_q;
  matrix<R::dimension, R::intrinsic_dimension> by_intrinsics;
  const auto r = residual.linearize_in_camera(view, q, o, by_q, by_intrinsics);
  if (!r) return r;
  by_camera.template leftCols<3>() = -by_q;
  by_camera.template middleCols<3>(3) = by_q * hat<double>(q);
  if constexpr (R::intrinsic_dimension != 0) by_camera.template rightCols<R::intrinsic_dimension>() = by_intrinsics;
  by_point = by_q * view.rotation;
  return r;
}

}  // namespace detail

}  // namespace orbis::optimize

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The concept of a camera model.
#pragma once

#include <concepts>
#include <optional>
#include <utility>

#include <orbis/core/types.hpp>

namespace orbis::camera {

namespace detail {

template <class C>
concept has_image_size = requires(const C& camera) {
  { camera.width() } -> std::convertible_to<int>;
  { camera.height() } -> std::convertible_to<int>;
};
template <class C>
concept projects = requires(const C& camera, const vec3& point) {
  { camera.project(point) } -> std::same_as<std::optional<vec2>>;
};
template <class C>
concept projects_with_jacobian = requires(const C& camera, const vec3& point, matrix<2, 3>& jacobian) {
  { camera.project(point, jacobian) } -> std::same_as<std::optional<vec2>>;
};
template <class C>
concept unprojects = requires(const C& camera, const vec2& pixel) {
  { camera.unproject(pixel) } -> std::same_as<std::optional<vec3>>;
};

}  // namespace detail

/// A central projection. In the camera frame, x points right, y down and z forward (metres). Pixel centres are at
/// integers.
///
/// - `project(p)`: the pixel of a point in the camera frame, empty if there is none (behind the camera, outside the
/// model's domain, a NaN). Accepts any point; does not check the image bounds.
/// - `project(p, J)`: the pixel, and its derivative with respect to the point (2x3).
/// - `unproject(pixel)`: the ray through a pixel, scaled to z = 1, empty if the inversion fails.
template <class C>
concept camera_model =
    detail::has_image_size<C> && detail::projects<C> && detail::projects_with_jacobian<C> && detail::unprojects<C>;

/// Provides `C` as `type`. If `C` lacks a member that `camera_model` requires, the first compiler error names that
/// member.
template <class C>
struct checked_camera {
  static_assert(detail::has_image_size<C>, "a camera model needs width() and height(), pixels");
  static_assert(detail::projects<C>, "a camera model needs project(vec3), which returns std::optional<vec2>");
  static_assert(detail::projects_with_jacobian<C>,
                "a camera model needs project(vec3, matrix<2, 3>& jacobian), which returns std::optional<vec2>");
  static_assert(detail::unprojects<C>, "a camera model needs unproject(vec2), which returns std::optional<vec3>");
  using type = C;
};

/// Returns `f(camera)`, or `camera.visit(f)` for a camera whose model is known only at run time (`any_camera`): `f`
/// then gets the model itself, which is faster in loops.
template <camera_model Camera, class F>
decltype(auto) with_model(const Camera& camera, F&& f) {
  if constexpr (requires { camera.visit(f); })
    return camera.visit(std::forward<F>(f));
  else
    return std::forward<F>(f)(camera);
}

}  // namespace orbis::camera

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a camera model is to our algorithms.
#pragma once

#include <concepts>
#include <optional>

#include <orbis/core/types.hpp>

namespace orbis::camera {

/// A central projection. Camera frame: x right, y down, z forward, metres. Pixels: centres at
/// integers.
///
/// - `project(p)`: the pixel of a point in the camera frame, empty where there is none (behind the
///   camera, outside the model's domain). Does not test against the image bounds.
/// - `project(p, J)`: the pixel, and the derivative of the pixel by the point (2x3).
/// - `unproject(pixel)`: the ray through a pixel, scaled to z = 1, empty where the inversion fails.
template <class C>
concept camera_model = requires(const C& camera, const vec3& point, const vec2& pixel, matrix<2, 3>& jacobian) {
  { camera.width() } -> std::convertible_to<int>;
  { camera.height() } -> std::convertible_to<int>;
  { camera.project(point) } -> std::same_as<std::optional<vec2>>;
  { camera.project(point, jacobian) } -> std::same_as<std::optional<vec2>>;
  { camera.unproject(pixel) } -> std::same_as<std::optional<vec3>>;
};

}  // namespace orbis::camera

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The rays through all pixels of a camera.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>

#include <orbis/camera/any.hpp>
#include <orbis/camera/detail/unproject_eight.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/types.hpp>

namespace orbis::camera {

/// Calls `use(x, y, ray)` for every pixel, row by row; `ray`, a `vec2`: x and y of the pixel's ray at z = 1, up to
/// rounding as `camera.unproject` returns it; NaN if there is none. O(pixels).
template <camera_model Camera, class Use>
void for_each_ray(const Camera& camera, const Use& use) {
  [[maybe_unused]] const auto ray_of = [&](int x, int y) {
    const auto ray = camera.unproject(vec2{x, y});
    return ray ? vec2{ray->x(), ray->y()} : filled<vec2>(std::numeric_limits<double>::quiet_NaN());
  };
  if constexpr (std::same_as<Camera, any_camera>) {
    camera.visit([&](const auto& model) { for_each_ray(model, use); });
  } else if constexpr (std::same_as<Camera, radial_tangential>) {
    const auto unproject =
        simd::kernel<detail::unproject_eight, void(const radial_tangential&, int, int, double*, double*)>();
    std::array<double, 8> u, v;
    for (int y = 0; y != camera.height(); ++y)
      for (int first = 0; first < camera.width(); first += 8) {
        unproject(camera, first, y, u.data(), v.data());
        for (int x = first; x != std::min(first + 8, camera.width()); ++x) {
          const auto i = static_cast<std::size_t>(x - first);
          use(x, y, std::isnan(u[i]) ? ray_of(x, y) : vec2{u[i], v[i]});
        }
      }
  } else {
    for (int y = 0; y != camera.height(); ++y)
      for (int x = 0; x != camera.width(); ++x) use(x, y, ray_of(x, y));
  }
}

/// Stores for every pixel of a camera the point where its ray meets the plane z = 1, so that unprojecting a depth costs
/// three multiplications. 8 bytes per pixel.
class ray_table {
 public:
  ray_table() = default;
  /// Computes the table with O(width * height) unprojections; pixels without a ray get NaN.
  template <camera_model Camera>
  explicit ray_table(const Camera& camera) : rays_{camera.width(), camera.height(), zeros<vec2f>()} {
    for_each_ray(camera, [&](int x, int y, const vec2& ray) { rays_(x, y) = ray.cast<float>(); });
  }

  [[nodiscard]] int width() const noexcept { return rays_.width(); }
  [[nodiscard]] int height() const noexcept { return rays_.height(); }
  /// x and y of the ray through the pixel at z = 1; NaN if the pixel has no ray. @pre the pixel is inside the image
  [[nodiscard]] const vec2f& operator()(int x, int y) const noexcept { return rays_(x, y); }
  /// The point at depth `z` metres on the pixel's ray, in the camera frame.
  [[nodiscard]] vec3f at(int x, int y, float z) const noexcept {
    const vec2f& ray = rays_(x, y);
    return {ray.x() * z, ray.y() * z, z};
  }

 private:
  image<vec2f> rays_;
};

}  // namespace orbis::camera

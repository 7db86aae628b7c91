// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Table with the ray through every pixel of a camera.
#pragma once

#include <limits>

#include <orbis/camera/model.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/types.hpp>

namespace orbis::camera {

/// Stores for every pixel of a camera the point where its ray meets the plane z = 1, so that unprojecting a depth costs
/// three multiplications. 8 bytes per pixel.
class ray_table {
 public:
  ray_table() = default;
  /// Computes the table with O(width * height) unprojections; pixels without a ray get NaN.
  template <camera_model Camera>
  explicit ray_table(const Camera& camera)
      : rays_{camera.width(), camera.height(), filled<vec2f>(std::numeric_limits<float>::quiet_NaN())} {
    for (int y = 0; y != camera.height(); ++y)
      for (int x = 0; x != camera.width(); ++x) {
        if (const auto ray = camera.unproject({x, y})) rays_(x, y) = ray->template head<2>().template cast<float>();
      }
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

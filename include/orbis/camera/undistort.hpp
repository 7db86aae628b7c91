// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Removal of lens distortion from images.
#pragma once

#include <cassert>
#include <concepts>
#include <cstdint>
#include <limits>
#include <optional>
#include <type_traits>

#include <orbis/camera/intrinsics.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/types.hpp>

namespace orbis::camera {

/// A camera model with a camera matrix, and hence with an equivalent pinhole camera.
template <class C>
concept has_intrinsics = camera_model<C> && requires(const C& camera) {
  { camera.k() } -> std::convertible_to<intrinsics>;
};

/// Remaps images of a camera to images of an ideal pinhole camera at the same position. Build it once and apply it to
/// every frame. 8 bytes per pixel.
class undistortion {
 public:
  /// Creates the table of pixels for an ideal camera at the position of `camera`, rotated by `R_camera_ideal`. One
  /// projection per pixel of `ideal`.
  template <camera_model Camera>
  undistortion(const Camera& camera, const pinhole& ideal, const mat3& R_camera_ideal = identity<mat3>())
      : source_width_{camera.width()},
        source_height_{camera.height()},
        source_{ideal.width(), ideal.height(), filled<vec2f>(std::numeric_limits<float>::quiet_NaN())} {
    for (int y = 0; y != ideal.height(); ++y)
      for (int x = 0; x != ideal.width(); ++x) {
        const auto ray = ideal.unproject({x, y});
        if (const auto pixel = ray ? camera.project(R_camera_ideal * *ray) : std::nullopt)
          source_(x, y) = pixel->template cast<float>();
      }
  }
  /// Creates the map to the pinhole camera with the size and camera matrix of `camera`.
  template <has_intrinsics Camera>
  explicit undistortion(const Camera& camera) : undistortion(camera, pinhole{camera.k()}) {}

  [[nodiscard]] int width() const noexcept { return source_.width(); }
  [[nodiscard]] int height() const noexcept { return source_.height(); }
  /// The position in the distorted image that corresponds to pixel (x, y) of the ideal image; NaN if there is none.
  [[nodiscard]] const vec2f& source(int x, int y) const noexcept { return source_(x, y); }

  /// Remaps with bilinear interpolation, for `rgb8` and `std::uint8_t`; pixels without a source get the value
  /// `outside`.
  /// @pre the image has the camera's size
  template <class T>
  requires std::same_as<std::remove_const_t<T>, rgb8> || std::same_as<std::remove_const_t<T>, std::uint8_t>
  [[nodiscard]] image<std::remove_const_t<T>> bilinear(image_view<T> distorted,
                                                       const std::remove_const_t<T>& outside = {}) const {
    return remap(distorted, outside, [](const auto& in, const vec2f& at) {
      const int x0 = static_cast<int>(at.x()), y0 = static_cast<int>(at.y());
      const int x1 = x0 + 1 < in.width() ? x0 + 1 : x0, y1 = y0 + 1 < in.height() ? y0 + 1 : y0;
      const float u = at.x() - static_cast<float>(x0), v = at.y() - static_cast<float>(y0);
      return mix(in(x0, y0), in(x1, y0), in(x0, y1), in(x1, y1), u, v);
    });
  }

  /// Remaps with nearest-neighbour sampling, for values that must not be interpolated: labels, and depth (measured
  /// along the optical axis, so that its value does not change).
  /// @pre the image has the camera's size
  template <class T>
  [[nodiscard]] image<std::remove_const_t<T>> nearest(image_view<T> distorted,
                                                      const std::remove_const_t<T>& outside = {}) const {
    return remap(distorted, outside, [](const auto& in, const vec2f& at) {
      return in(static_cast<int>(at.x() + 0.5F), static_cast<int>(at.y() + 0.5F));
    });
  }

 private:
  template <class T, class Sample>
  [[nodiscard]] image<std::remove_const_t<T>> remap(image_view<T> in, const std::remove_const_t<T>& outside,
                                                    Sample&& sample) const {
    assert(in.width() == source_width_ && in.height() == source_height_);
    image<std::remove_const_t<T>> out{width(), height(), outside};
    const auto right = static_cast<float>(in.width() - 1), bottom = static_cast<float>(in.height() - 1);
    for (int y = 0; y != height(); ++y)
      for (int x = 0; x != width(); ++x) {
        const vec2f& at = source_(x, y);
        if (at.x() >= 0.0F && at.y() >= 0.0F && at.x() <= right && at.y() <= bottom) out(x, y) = sample(in, at);
      }
    return out;
  }

  [[nodiscard]] static std::uint8_t mix(std::uint8_t a, std::uint8_t b, std::uint8_t c, std::uint8_t d, float u,
                                        float v) noexcept {
    const float top = static_cast<float>(a) * (1.0F - u) + static_cast<float>(b) * u;
    const float low = static_cast<float>(c) * (1.0F - u) + static_cast<float>(d) * u;
    return static_cast<std::uint8_t>(top * (1.0F - v) + low * v + 0.5F);
  }
  [[nodiscard]] static rgb8 mix(const rgb8& a, const rgb8& b, const rgb8& c, const rgb8& d, float u, float v) noexcept {
    return {mix(a.r, b.r, c.r, d.r, u, v), mix(a.g, b.g, c.g, d.g, u, v), mix(a.b, b.b, c.b, d.b, u, v)};
  }

  int source_width_ = 0;
  int source_height_ = 0;
  image<vec2f> source_;
};

}  // namespace orbis::camera

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Depth images: `uint16` with a scale, or `float` metres.
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <orbis/core/image.hpp>

namespace orbis::camera {

/// A source of depth along the optical axis (z, not range along the ray): `operator()` returns metres, or 0 for pixels
/// without a measurement.
template <class D>
concept depth_source = requires(const D& depth, int x, int y) {
  { depth.width() } -> std::convertible_to<int>;
  { depth.height() } -> std::convertible_to<int>;
  { depth(x, y) } -> std::same_as<float>;
};

/// A non-owning view of a depth image. `T` is `std::uint16_t` (value / scale = metres; 0 and 65535 are invalid) or
/// `float` (metres times scale; NaN, inf, 0 and negative values are invalid). Values outside `[min_depth, max_depth]`
/// metres are also invalid.
template <class T>
requires std::same_as<T, std::uint16_t> || std::same_as<T, float>
class depth_view {
 public:
  depth_view() = default;
  explicit depth_view(image_view<const T> pixels, double scale = 1.0, float min_depth = 0.0F,
                      float max_depth = std::numeric_limits<float>::max()) noexcept
      : pixels_{pixels}, scale_{scale}, min_{min_depth}, max_{max_depth} {}

  [[nodiscard]] int width() const noexcept { return pixels_.width(); }
  [[nodiscard]] int height() const noexcept { return pixels_.height(); }
  [[nodiscard]] image_view<const T> pixels() const noexcept { return pixels_; }
  [[nodiscard]] double scale() const noexcept { return scale_; }
  /// The range of valid depths, metres.
  [[nodiscard]] float min_depth() const noexcept { return min_; }
  [[nodiscard]] float max_depth() const noexcept { return max_; }
  /// A view of the same pixels with a narrower range of valid depths, in metres.
  [[nodiscard]] depth_view within(float min_depth, float max_depth) const noexcept {
    return depth_view(pixels_, scale_, std::max(min_, min_depth), std::min(max_, max_depth));
  }

  /// Depth in metres, or 0 if invalid.
  [[nodiscard]] float operator()(int x, int y) const noexcept {
    const T stored = pixels_(x, y);
    if constexpr (std::same_as<T, std::uint16_t>) {
      if (stored == 0 || stored == std::numeric_limits<std::uint16_t>::max()) return 0.0F;
    } else {
      if (!(stored > 0.0F) || !std::isfinite(stored)) return 0.0F;
    }
    const auto metres = static_cast<float>(static_cast<double>(stored) / scale_);
    return metres >= min_ && metres <= max_ ? metres : 0.0F;
  }

 private:
  image_view<const T> pixels_;
  double scale_ = 1.0;
  float min_ = 0.0F;
  float max_ = std::numeric_limits<float>::max();
};

template <class T, class... Range>
depth_view(image_view<T>, Range...) -> depth_view<std::remove_const_t<T>>;
template <class T, class... Range>
depth_view(const image<T>&, Range...) -> depth_view<T>;

/// True if `D` is a `depth_view`.
template <class D>
inline constexpr bool is_depth_view = false;
template <class T>
inline constexpr bool is_depth_view<depth_view<T>> = true;

namespace detail {

template <class D>
struct depth_pixel : std::type_identity<float> {};
template <class T>
struct depth_pixel<depth_view<T>> : std::type_identity<T> {};

}  // namespace detail

/// The pixel type of a copy of a depth image: for a `depth_view` the type of its stored values, otherwise `float`
/// (metres).
template <depth_source D>
using depth_pixel = typename detail::depth_pixel<D>::type;

}  // namespace orbis::camera

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Images as pointer, size and stride. Pixel centres have integer coordinates; (0, 0) is the top left pixel.
#pragma once

#include <algorithm>
#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

namespace orbis {

/// One colour pixel, in memory order.
struct rgb8 {
  std::uint8_t r = 0, g = 0, b = 0;
  friend bool operator==(const rgb8&, const rgb8&) = default;
};
static_assert(sizeof(rgb8) == 3);

/// A non-owning view of a rectangle of pixels.
template <class T>
class image_view {
 public:
  using value_type = std::remove_const_t<T>;

  constexpr image_view() noexcept = default;
  /// `stride`: distance between rows, in elements of `T`.
  /// @pre stride >= width, and `data` holds `(height - 1) * stride + width` pixels
  constexpr image_view(T* data, int width, int height, std::ptrdiff_t stride) noexcept
      : data_{data}, width_{width}, height_{height}, stride_{stride} {
    assert(width >= 0 && height >= 0 && stride >= width);
  }
  constexpr image_view(T* data, int width, int height) noexcept : image_view(data, width, height, width) {}
  /// Converts a mutable view to a const view. A template, so that it never replaces the copy constructor.
  template <class U>
  requires(std::is_const_v<T>&& std::same_as<U, value_type>) constexpr image_view(const image_view<U>& other) noexcept
      : image_view(other.data(), other.width(), other.height(), other.stride()) {}

  [[nodiscard]] constexpr int width() const noexcept { return width_; }
  [[nodiscard]] constexpr int height() const noexcept { return height_; }
  [[nodiscard]] constexpr std::ptrdiff_t stride() const noexcept { return stride_; }
  [[nodiscard]] constexpr T* data() const noexcept { return data_; }
  [[nodiscard]] constexpr bool empty() const noexcept { return width_ == 0 || height_ == 0; }
  [[nodiscard]] constexpr bool contains(int x, int y) const noexcept {
    return x >= 0 && y >= 0 && x < width_ && y < height_;
  }
  [[nodiscard]] constexpr std::span<T> row(int y) const noexcept {
    assert(y >= 0 && y < height_);
    return {data_ + y * stride_, static_cast<std::size_t>(width_)};
  }
  /// @pre contains(x, y)
  [[nodiscard]] constexpr T& operator()(int x, int y) const noexcept {
    assert(contains(x, y));
    return data_[y * stride_ + x];
  }

 private:
  T* data_ = nullptr;
  int width_ = 0;
  int height_ = 0;
  std::ptrdiff_t stride_ = 0;
};

/// An image that owns its pixels; rows are contiguous.
template <class T>
class image {
 public:
  using value_type = T;

  image() = default;
  image(int width, int height, const T& value = T{})
      : width_{width},
        height_{height},
        pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), value) {
    assert(width >= 0 && height >= 0);
  }
  /// Copies the pixels of a view.
  explicit image(image_view<const T> from) : width_{from.width()}, height_{from.height()} {
    pixels_.reserve(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
    for (int y = 0; y != height_; ++y) pixels_.insert(pixels_.end(), from.row(y).begin(), from.row(y).end());
  }

  [[nodiscard]] int width() const noexcept { return width_; }
  [[nodiscard]] int height() const noexcept { return height_; }
  [[nodiscard]] bool empty() const noexcept { return pixels_.empty(); }
  [[nodiscard]] T* data() noexcept { return pixels_.data(); }
  [[nodiscard]] const T* data() const noexcept { return pixels_.data(); }
  [[nodiscard]] std::span<T> pixels() noexcept { return pixels_; }
  [[nodiscard]] std::span<const T> pixels() const noexcept { return pixels_; }
  [[nodiscard]] image_view<T> view() noexcept { return {pixels_.data(), width_, height_}; }
  [[nodiscard]] image_view<const T> view() const noexcept { return {pixels_.data(), width_, height_}; }
  operator image_view<T>() noexcept { return view(); }              // NOLINT(google-explicit-constructor)
  operator image_view<const T>() const noexcept { return view(); }  // NOLINT(google-explicit-constructor)
  [[nodiscard]] std::span<T> row(int y) noexcept { return view().row(y); }
  [[nodiscard]] std::span<const T> row(int y) const noexcept { return view().row(y); }
  [[nodiscard]] T& operator()(int x, int y) noexcept { return view()(x, y); }
  [[nodiscard]] const T& operator()(int x, int y) const noexcept { return view()(x, y); }
  friend bool operator==(const image&, const image&) = default;

 private:
  int width_ = 0;
  int height_ = 0;
  std::vector<T> pixels_;
};

/// Copies the pixels of a view into `to`, reusing its memory if the size matches. O(pixels).
/// @pre `from` does not alias `to`
template <class T>
void copy_pixels(std::type_identity_t<image_view<const T>> from, image<T>& to) {
  if (to.width() != from.width() || to.height() != from.height())
    to = image<T>(from);
  else
    for (int y = 0; y != from.height(); ++y) std::ranges::copy(from.row(y), to.row(y).begin());
}

}  // namespace orbis

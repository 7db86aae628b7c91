// SPDX-License-Identifier: BSD-3-Clause
//
// Pictures for the tests of features.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/simd.hpp>

namespace orbis::test {

/// Blocks of random brightness at two scales: corners everywhere.
inline image<std::uint8_t> blocks(int width, int height, std::uint64_t seed) {
  image<std::uint8_t> im(width, height);
  for (int y = 0; y != height; ++y)
    for (int x = 0; x != width; ++x) {
      const auto at = [&](int cell, std::uint64_t salt) {
        return mix64(seed ^ mix64(salt + static_cast<std::uint64_t>((y / cell) * 1000 + x / cell))) % 100;
      };
      im(x, y) = static_cast<std::uint8_t>(20 + at(11, 1) + at(29, 1 << 20));
    }
  return im;
}

/// Every pixel for itself, over all of its range.
inline image<std::uint8_t> noise(int width, int height, std::uint64_t seed) {
  image<std::uint8_t> im(width, height);
  random_bits random{seed};
  for (std::uint8_t& pixel : im.pixels()) pixel = static_cast<std::uint8_t>(random());
  return im;
}

/// Pixels of a view at an odd address, with an odd stride, in the midst of other ones.
struct embedded_image {
  explicit embedded_image(image_view<const std::uint8_t> from, std::uint8_t around = 77)
      : width{from.width()}, height{from.height()}, stride{from.width() + 13} {
    pixels.assign(static_cast<std::size_t>(stride) * static_cast<std::size_t>(height) + 7, around);
    for (int y = 0; y != height; ++y)
      for (int x = 0; x != width; ++x) pixels[static_cast<std::size_t>(7 + y * stride + x)] = from(x, y);
    // No byte more than the view needs, so that tools see a read beyond it.
    pixels.resize(static_cast<std::size_t>(7 + (height - 1) * stride + width));
    pixels.shrink_to_fit();
  }
  [[nodiscard]] image_view<const std::uint8_t> view() const { return {pixels.data() + 7, width, height, stride}; }

  int width, height, stride;
  std::vector<std::uint8_t> pixels;
};

/// The image turned about `(cx, cy)` by `angle` and then shifted, bilinear; 0 outside.
inline image<std::uint8_t> moved(const image<std::uint8_t>& from, double angle, double shift_x, double shift_y) {
  const double cx = from.width() / 2.0, cy = from.height() / 2.0;
  image<std::uint8_t> to(from.width(), from.height());
  for (int y = 0; y != to.height(); ++y)
    for (int x = 0; x != to.width(); ++x) {
      const double dx = x - cx - shift_x, dy = y - cy - shift_y;
      const double u = std::cos(angle) * dx + std::sin(angle) * dy + cx;
      const double v = -std::sin(angle) * dx + std::cos(angle) * dy + cy;
      const int iu = static_cast<int>(std::floor(u)), iv = static_cast<int>(std::floor(v));
      if (!from.view().contains(iu, iv) || !from.view().contains(iu + 1, iv + 1)) continue;
      const double a = u - iu, b = v - iv;
      const double value = (1 - a) * (1 - b) * from(iu, iv) + a * (1 - b) * from(iu + 1, iv) +
                           (1 - a) * b * from(iu, iv + 1) + a * b * from(iu + 1, iv + 1);
      to(x, y) = static_cast<std::uint8_t>(std::lround(value));
    }
  return to;
}

}  // namespace orbis::test

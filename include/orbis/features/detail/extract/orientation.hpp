// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Orientation of a keypoint.
#pragma once

#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include <orbis/core/image.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/integer.hpp>
#include <orbis/core/simd/math.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/features/detail/extract/byte_pairs.hpp>
#include <orbis/features/detail/extract/orb_parts.hpp>
#include <orbis/features/extractor.hpp>

namespace orbis::features::detail {

/// Half-width of the disc, indexed by the distance of the row from the centre.
inline constexpr std::array<int, disc_radius + 1> disc_half_width = [] {
  std::array<int, disc_radius + 1> widths{};
  for (int dy = 0; dy <= disc_radius; ++dy) {
    int& w = widths[static_cast<std::size_t>(dy)];
    while ((w + 1) * (w + 1) + dy * dy <= disc_radius * (disc_radius + 1)) ++w;
  }
  return widths;
}();

/// Sums of x times brightness and y times brightness over the disc.
struct image_moments {
  std::int32_t x = 0;
  std::int32_t y = 0;
  friend bool operator==(const image_moments&, const image_moments&) = default;
};

/// Masks that select the disc's pixels from pixels -15 to 16 of a row, relative to the centre; indexed by the distance
/// of the row from the centre.
inline constexpr auto disc_masks = [] {
  std::array<std::array<std::uint8_t, 32>, disc_radius + 1> masks{};
  for (std::size_t dy = 0; dy != masks.size(); ++dy)
    for (int dx = -disc_half_width[dy]; dx <= disc_half_width[dy]; ++dx)
      masks[dy][static_cast<std::size_t>(dx + disc_radius)] = 255;
  return masks;
}();

struct disc_moments_kernel {
  using signature = image_moments(const std::uint8_t* centre, std::ptrdiff_t stride);
  template <class Target>
  static ORBIS_ALWAYS_INLINE image_moments run(const std::uint8_t* centre, std::ptrdiff_t stride) {
    using bytes = simd::vec<std::uint8_t, 32, Target>;
    using words = simd::vec<std::uint16_t, 16, Target>;  // sums of every other column
    const std::uint8_t* const left = centre - disc_radius;
    const auto pixels = [&](int dy) ORBIS_INLINE_LAMBDA {
      return bytes::load(left + dy * stride) &
             bytes::load(disc_masks[static_cast<std::size_t>(dy < 0 ? -dy : dy)].data());
    };
    // The sum of each column, and the sum of dy times brightness: at most 31 * 255 and 120 * 255, which fits into 16
    // bits. The latter accumulates the differences of all rows at least k from the centre, for k from 15 to 1.
    const bytes middle = pixels(0);
    words sum_even = even_bytes(middle), sum_odd = odd_bytes(middle);
    words step_even(0), step_odd(0), y_even(0), y_odd(0);
    for (int dy = disc_radius; dy != 0; --dy) {
      const bytes above = pixels(-dy), below = pixels(dy);
      const words above_even = even_bytes(above), below_even = even_bytes(below);
      const words above_odd = odd_bytes(above), below_odd = odd_bytes(below);
      sum_even += above_even + below_even;
      sum_odd += above_odd + below_odd;
      step_even += below_even - above_even;
      step_odd += below_odd - above_odd;
      y_even += step_even;
      y_odd += step_odd;
    }
    const auto weighted = [](const words& even, const words& odd, auto weight) ORBIS_INLINE_LAMBDA {
      using signed_words = simd::vec<std::int16_t, 16, Target>;
      const auto weights = [&](int offset) ORBIS_INLINE_LAMBDA {
        return signed_words::generate(
            [&](std::size_t i) ORBIS_INLINE_LAMBDA { return weight(2 * static_cast<int>(i) + offset - disc_radius); });
      };
      return simd::sum(multiply_add_pairs(simd::bits_as<std::int16_t>(even), weights(0)) +
                       multiply_add_pairs(simd::bits_as<std::int16_t>(odd), weights(1)));
    };
    return {weighted(sum_even, sum_odd, [](int x) ORBIS_INLINE_LAMBDA { return x; }),
            weighted(y_even, y_odd, [](int) ORBIS_INLINE_LAMBDA { return 1; })};
  }
};

/// The angle of (x, y) in [0, 2 pi), accurate to 1e-7; bit-identical on every machine with IEEE doubles.
[[nodiscard]] inline float polar_angle(double x, double y) noexcept {
  using std::numbers::pi;
  const double ax = std::abs(x), ay = std::abs(y);
  if (!(ax + ay > 0.0)) return 0.0F;
  // Reduces the problem to the atan of a ratio below 1, then to a ratio below tan(pi / 8), then uses a series.
  double t = ax < ay ? ax / ay : ay / ax;
  const bool upper = t > std::numbers::sqrt2 - 1.0;
  if (upper) t = (t - 1.0) / (t + 1.0);
  const double s = t * t;
  double angle =
      t *
      (1.0 - s * (1.0 / 3 -
                  s * (1.0 / 5 - s * (1.0 / 7 - s * (1.0 / 9 - s * (1.0 / 11 - s * (1.0 / 13 - s * (1.0 / 15))))))));
  if (upper) angle += pi / 4;
  if (ax < ay) angle = pi / 2 - angle;
  if (x < 0.0) angle = pi - angle;
  if (y < 0.0) angle = 2.0 * pi - angle;
  const auto rounded = static_cast<float>(angle);
  return rounded < 2.0F * std::numbers::pi_v<float> ? rounded : 0.0F;
}

ORBIS_LAZY_INLINE orientation intensity_centroid::operator()(image_view<const std::uint8_t> image, int x, int y) const {
  assert(x >= radius && y >= radius && x + radius + 1 < image.width() && y + radius < image.height());
  const auto moments = simd::kernel<disc_moments_kernel, disc_moments_kernel::signature>();
  const image_moments m = moments(image.data() + y * image.stride() + x, image.stride());
  if (m.x == 0 && m.y == 0) return {};
  const double mx = m.x, my = m.y;
  const double inverse = 1.0 / std::sqrt(mx * mx + my * my);  // exact before the square root: below 2^53
  return {polar_angle(mx, my), static_cast<float>(mx * inverse), static_cast<float>(my * inverse)};
}

}  // namespace orbis::features::detail

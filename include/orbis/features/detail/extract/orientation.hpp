// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Which way a keypoint points.
#pragma once

#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include <orbis/core/image.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/features/detail/extract/lanes16.hpp>
#include <orbis/features/extractor.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::features::detail {

inline constexpr int disc_radius = 15;

/// How far the disc reaches to both sides, by distance of the row from its centre.
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
using disc_moments = image_moments(const std::uint8_t* centre, std::ptrdiff_t stride);

/// Which of the 32 pixels of a row from -15 to 16 lie in the disc, by distance of the row from its centre.
inline constexpr auto disc_masks = [] {
  std::array<std::array<std::uint8_t, 32>, disc_radius + 1> masks{};
  for (std::size_t dy = 0; dy != masks.size(); ++dy)
    for (int dx = -disc_half_width[dy]; dx <= disc_half_width[dy]; ++dx)
      masks[dy][static_cast<std::size_t>(dx + disc_radius)] = 255;
  return masks;
}();

inline image_moments disc_moments_portable(const std::uint8_t* centre, std::ptrdiff_t stride) {
  image_moments m;
  for (int left = -disc_radius; left <= 1; left += 16) {
    const auto pixels = [&](int dy) {
      const auto& mask = disc_masks[static_cast<std::size_t>(dy < 0 ? -dy : dy)];
      return load16(centre + dy * stride + left) & load16(mask.data() + left + disc_radius);
    };
    // Of each column the sum, and the sum of dy times brightness: at most 31 * 255 and 120 * 255, so that words do.
    words8 sum_low = low_bytes(pixels(0)), sum_high = high_bytes(pixels(0)), y_low{}, y_high{};
    for (int dy = 1; dy <= disc_radius; ++dy) {
      const bytes16 above = pixels(-dy), below = pixels(dy);
      const auto times = static_cast<std::uint16_t>(dy);
      sum_low += low_bytes(below) + low_bytes(above);
      sum_high += high_bytes(below) + high_bytes(above);
      y_low += (low_bytes(below) - low_bytes(above)) * times;
      y_high += (high_bytes(below) - high_bytes(above)) * times;
    }
    constexpr bytes16 order{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
    const words8 at_low = low_bytes(order), at_high = high_bytes(order);
    for (std::size_t i = 0; i != 8; ++i) {
      m.x += (left + at_low[i]) * sum_low[i] + (left + at_high[i]) * sum_high[i];
      m.y += static_cast<std::int16_t>(y_low[i]) + static_cast<std::int16_t>(y_high[i]);
    }
  }
  return m;
}

#if ORBIS_X86
/// Weights of the 32 pixels of a row from -15 to 16, row by row.
struct disc_row {
  std::array<std::int8_t, 32> x{};
  std::array<std::int8_t, 32> y{};
};
inline constexpr auto disc_rows = [] {
  std::array<disc_row, 2 * disc_radius + 1> rows{};
  for (int dy = -disc_radius; dy <= disc_radius; ++dy) {
    const int reach = disc_half_width[static_cast<std::size_t>(dy < 0 ? -dy : dy)];
    disc_row& row = rows[static_cast<std::size_t>(dy + disc_radius)];
    for (int dx = -reach; dx <= reach; ++dx) {
      row.x[static_cast<std::size_t>(dx + disc_radius)] = static_cast<std::int8_t>(dx);
      row.y[static_cast<std::size_t>(dx + disc_radius)] = static_cast<std::int8_t>(dy);
    }
  }
  return rows;
}();

ORBIS_TARGET("avx2")
inline image_moments disc_moments_avx2(const std::uint8_t* centre, std::ptrdiff_t stride) {
  const auto load = [&](const void* p)
                        ORBIS_TARGET("avx2") { return _mm256_loadu_si256(static_cast<const __m256i*>(p)); };
  const __m256i ones = _mm256_set1_epi16(1);
  __m256i sum_x = _mm256_setzero_si256(), sum_y = sum_x;
  const std::uint8_t* row = centre - disc_radius * stride - disc_radius;
  for (std::size_t first = 0; first < disc_rows.size(); first += 4) {
    // A word grows by at most 255 (15 + 15) a row: four rows fit.
    __m256i x = _mm256_setzero_si256(), y = x;
    for (std::size_t i = first; i < first + 4 && i < disc_rows.size(); ++i, row += stride) {
      const __m256i pixels = load(row);
      x = _mm256_add_epi16(x, _mm256_maddubs_epi16(pixels, load(disc_rows[i].x.data())));
      y = _mm256_add_epi16(y, _mm256_maddubs_epi16(pixels, load(disc_rows[i].y.data())));
    }
    sum_x = _mm256_add_epi32(sum_x, _mm256_madd_epi16(x, ones));
    sum_y = _mm256_add_epi32(sum_y, _mm256_madd_epi16(y, ones));
  }
  __m256i both = _mm256_hadd_epi32(sum_x, sum_y);  // x x y y | x x y y
  both = _mm256_hadd_epi32(both, both);            // x y x y | x y x y
  const __m128i sum = _mm_add_epi32(_mm256_castsi256_si128(both), _mm256_extracti128_si256(both, 1));
  return {_mm_extract_epi32(sum, 0), _mm_extract_epi32(sum, 1)};
}
#endif

/// The angle of (x, y) in [0, 2 pi), to 1e-7; the same bits wherever doubles are IEEE's.
[[nodiscard]] inline float angle_of(double x, double y) noexcept {
  using std::numbers::pi;
  const double ax = std::abs(x), ay = std::abs(y);
  if (!(ax + ay > 0.0)) return 0.0F;
  // atan of the ratio below 1, from there to below tan(pi / 8), from there a series.
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

/// The direction from a pixel to the centre of brightness of the disc of radius 15 around it
/// (Rosin, "Measuring corner properties", 1999, as in the ORB paper); 0 where there is none.
struct intensity_centroid {
  static constexpr int radius = disc_radius;

  /// @pre at least `radius` pixels from the image's edge, on the right one more
  [[nodiscard]] orientation operator()(simd::level level, image_view<const std::uint8_t> image, int x, int y) const {
    assert(x >= radius && y >= radius && x + radius + 1 < image.width() && y + radius < image.height());
#if ORBIS_X86
    const auto moments =
        simd::select<disc_moments>(level, {.portable = disc_moments_portable, .avx2 = disc_moments_avx2});
#else
    (void)level;
    const auto moments = disc_moments_portable;
#endif
    const image_moments m = moments(image.data() + y * image.stride() + x, image.stride());
    if (m.x == 0 && m.y == 0) return {};
    const double mx = m.x, my = m.y;
    const double inverse = 1.0 / std::sqrt(mx * mx + my * my);  // exact below the root: 2^53 is not reached
    return {angle_of(mx, my), static_cast<float>(mx * inverse), static_cast<float>(my * inverse)};
  }
};

/// No rotation, for cameras that do not roll: descriptors tell more apart if they need not turn.
struct upright {
  static constexpr int radius = 0;
  [[nodiscard]] orientation operator()(simd::level, image_view<const std::uint8_t>, int, int) const noexcept {
    return {};
  }
};

}  // namespace orbis::features::detail

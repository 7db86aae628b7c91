// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Binary descriptors by comparing brightness in a rotated pattern.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/rounded.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/detail/extract/lanes16.hpp>
#include <orbis/features/detail/extract/orb_pattern.hpp>
#include <orbis/features/detail/extract/orientation.hpp>
#include <orbis/features/detail/extract/smooth.hpp>
#include <orbis/features/extractor.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::features::detail {

/// The coordinates of the tests' first pixels, then those of their second ones.
struct alignas(64) split_pattern {
  std::array<float, 512> x;
  std::array<float, 512> y;
};
inline constexpr split_pattern orb_points = [] {
  split_pattern p{};
  for (std::size_t i = 0; i != orb_pattern.size(); ++i) {
    p.x[i] = static_cast<float>(orb_pattern[i].x0);
    p.y[i] = static_cast<float>(orb_pattern[i].y0);
    p.x[i + 256] = static_cast<float>(orb_pattern[i].x1);
    p.y[i + 256] = static_cast<float>(orb_pattern[i].y1);
  }
  return p;
}();

/// Rotates all points and looks up their brightness.
using steered_pixels = void(const split_pattern& points, const orientation& o, const std::uint8_t* centre,
                            std::ptrdiff_t stride, std::uint8_t* brightness);
/// Bit i: is byte 256 + i larger than byte i?
using compare_halves = binary_descriptor<256>(const std::uint8_t* bytes);

/// Adding it leaves the nearest integer (ties to even) in the low bits of a small float.
inline constexpr float rounder = 12582912.0F;

[[nodiscard]] inline std::ptrdiff_t nearest_integer(float v) noexcept {
  return static_cast<std::ptrdiff_t>(std::bit_cast<std::int32_t>(v + rounder)) - std::bit_cast<std::int32_t>(rounder);
}

inline void steered_pixels_portable(const split_pattern& points, const orientation& o, const std::uint8_t* centre,
                                    std::ptrdiff_t stride, std::uint8_t* brightness) {
  const floats4 cosine = floats4{} + o.cosine, sine = floats4{} + o.sine;
  const auto step = static_cast<std::int32_t>(stride), bias = std::bit_cast<std::int32_t>(rounder);
  const auto nearest = [&](floats4 v) { return std::bit_cast<ints4>(v + rounder) - bias; };
  std::array<std::int32_t, 512> at;
  for (std::size_t i = 0; i != at.size(); i += 4) {
    const auto px = loaded<floats4>(points.x.data() + i), py = loaded<floats4>(points.y.data() + i);
    const floats4 x = rounded_products(px, cosine) - rounded_products(py, sine);
    const floats4 y = rounded_products(px, sine) + rounded_products(py, cosine);
    store(at.data() + i, nearest(y) * step + nearest(x));
  }
  for (std::size_t i = 0; i != at.size(); ++i) brightness[i] = centre[at[i]];
}

inline binary_descriptor<256> compare_halves_portable(const std::uint8_t* bytes) {
  binary_descriptor<256> d;
  for (std::size_t i = 0; i != 256; i += 16) {
    const auto less = std::bit_cast<bytes16>(load16(bytes + i) < load16(bytes + 256 + i));
    d.words[i / 64] |= std::uint64_t{bits16(less)} << (i % 64);
  }
  return d;
}

#if ORBIS_X86
ORBIS_TARGET("avx2")
inline void steered_pixels_avx2(const split_pattern& points, const orientation& o, const std::uint8_t* centre,
                                std::ptrdiff_t stride, std::uint8_t* brightness) {
  const __m256 cosine = _mm256_set1_ps(o.cosine), sine = _mm256_set1_ps(o.sine), magic = _mm256_set1_ps(rounder);
  const __m256i step = _mm256_set1_epi32(static_cast<int>(stride));
  // y stride + x with the rounder's bits still in both; they are taken out together.
  const auto offset =
      static_cast<std::uint32_t>(std::bit_cast<std::int32_t>(rounder)) * (static_cast<std::uint32_t>(stride) + 1);
  const __m256i unmagic = _mm256_set1_epi32(static_cast<int>(offset));
  const auto product = [&](__m256 a, __m256 b) ORBIS_TARGET("avx2") {
    __m256 p = _mm256_mul_ps(a, b);
    asm("" : "+x"(p));  // no fused multiply-add
    return p;
  };
  alignas(32) std::array<std::int32_t, 512> at;
  for (std::size_t i = 0; i != at.size(); i += 8) {
    const __m256 px = _mm256_load_ps(points.x.data() + i), py = _mm256_load_ps(points.y.data() + i);
    const __m256 x = _mm256_sub_ps(product(px, cosine), product(py, sine));
    const __m256 y = _mm256_add_ps(product(px, sine), product(py, cosine));
    const __m256i ix = _mm256_castps_si256(_mm256_add_ps(x, magic)), iy = _mm256_castps_si256(_mm256_add_ps(y, magic));
    const __m256i sum = _mm256_add_epi32(_mm256_mullo_epi32(iy, step), ix);
    _mm256_store_si256(reinterpret_cast<__m256i*>(at.data() + i), _mm256_sub_epi32(sum, unmagic));
  }
#pragma GCC unroll 8
  for (std::size_t i = 0; i != at.size(); ++i) brightness[i] = centre[at[i]];
}

ORBIS_TARGET("avx2")
inline binary_descriptor<256> compare_halves_avx2(const std::uint8_t* bytes) {
  binary_descriptor<256> d;
  const auto thirty_two = [&](std::size_t i) ORBIS_TARGET("avx2") {
    const __m256i a = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(bytes + i));
    const __m256i b = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(bytes + 256 + i));
    const __m256i not_larger = _mm256_cmpeq_epi8(_mm256_subs_epu8(b, a), _mm256_setzero_si256());
    return ~static_cast<std::uint32_t>(_mm256_movemask_epi8(not_larger));
  };
  for (std::size_t w = 0; w != 4; ++w)
    d.words[w] = thirty_two(64 * w) | static_cast<std::uint64_t>(thirty_two(64 * w + 32)) << 32U;
  return d;
}
#endif

/// ORB's descriptor: the standard pattern, turned to the keypoint's direction and rounded to pixels,
/// on the image smoothed by a Gaussian (7x7, sigma 2). The same bits at every level; those of
/// OpenCV's ORB wherever the direction is the same.
struct steered_brief {
  using descriptor = binary_descriptor<256>;
  static constexpr int reach = 18;     ///< of the turned pattern, pixels
  static constexpr int diameter = 31;  ///< of the described neighbourhood, by convention

  struct workspace {
    std::vector<std::uint8_t> pixels;
    image_view<const std::uint8_t> smoothed;
    smooth_workspace smoothing;
  };

  /// Smooths what descriptors of keypoints in rows `[first, last)` need. @pre image of at least 4x4 pixels
  void prepare(simd::level level, image_view<const std::uint8_t> image, int first, int last, workspace& memory) const {
    const std::ptrdiff_t stride = (static_cast<std::ptrdiff_t>(image.width()) + 63) / 64 * 64;
    const auto needed = static_cast<std::size_t>(stride) * static_cast<std::size_t>(image.height());
    if (memory.pixels.size() < needed) memory.pixels.resize(needed);
    const image_view<std::uint8_t> to{memory.pixels.data(), image.width(), image.height(), stride};
    smooth(level, image, to, std::max(0, first - reach), std::min(image.height(), last + reach), memory.smoothing);
    memory.smoothed = to;
  }

  /// @pre at least `reach` pixels from the edge of the prepared image, in its prepared rows
  [[nodiscard]] descriptor operator()(simd::level level, const workspace& prepared, int x, int y,
                                      const orientation& o) const {
    const image_view<const std::uint8_t>& image = prepared.smoothed;
    assert(x >= reach && y >= reach && x + reach < image.width() && y + reach < image.height());
#if ORBIS_X86
    const auto pixels =
        simd::select<steered_pixels>(level, {.portable = steered_pixels_portable, .avx2 = steered_pixels_avx2});
    const auto compare =
        simd::select<compare_halves>(level, {.portable = compare_halves_portable, .avx2 = compare_halves_avx2});
#else
    (void)level;
    const auto pixels = steered_pixels_portable;
    const auto compare = compare_halves_portable;
#endif
    std::array<std::uint8_t, 512> brightness;
    pixels(orb_points, o, image.data() + y * image.stride() + x, image.stride(), brightness.data());
    return compare(brightness.data());
  }
};

}  // namespace orbis::features::detail

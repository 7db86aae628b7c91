// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Gaussian smoothing of 8-bit images, exact in fixed point.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/features/detail/extract/lanes16.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::features::detail {

/// Memory that `smooth` uses again and again.
struct smooth_workspace {
  std::vector<std::uint8_t> line;   ///< a row with its reflections
  std::vector<std::uint16_t> sums;  ///< the last eight rows, smoothed horizontally
};

/// A Gaussian of sigma 2 at -3 ... 3, in 1/256; their sum is exactly one.
inline constexpr std::array<int, 7> gaussian_weights{18, 34, 48, 56, 48, 34, 18};
inline constexpr int smooth_lanes = 32;

/// Weighted sums along a row. The order of the 16-bit words within a block of 32 is the kernel's own.
/// @pre `line` is readable from -3 to 3 + `count` rounded up to 32
using smooth_along = void(const std::uint8_t* line, int count, std::uint16_t* sums);
/// Weighted sum of seven such rows, rounded, in the pixels' order.
using smooth_across = void(const std::array<const std::uint16_t*, 7>& rows, int count, std::uint8_t* to);

[[nodiscard]] inline words8 gaussian_sum(const std::array<words8, 7>& v) noexcept {
  const auto weight = [](std::size_t i) { return static_cast<std::uint16_t>(gaussian_weights[i]); };
  return (v[0] + v[6]) * weight(0) + (v[1] + v[5]) * weight(1) + (v[2] + v[4]) * weight(2) + v[3] * weight(3);
}

inline void smooth_along_portable(const std::uint8_t* line, int count, std::uint16_t* sums) {
  for (int x = 0; x < count; x += 16) {
    std::array<words8, 7> low, high;
    for (int i = 0; i != 7; ++i) {
      const bytes16 v = load16(line + x + i - 3);
      low[static_cast<std::size_t>(i)] = low_bytes(v);
      high[static_cast<std::size_t>(i)] = high_bytes(v);
    }
    store(sums + x, gaussian_sum(low));
    store(sums + x + 8, gaussian_sum(high));
  }
}

inline void smooth_across_portable(const std::array<const std::uint16_t*, 7>& rows, int count, std::uint8_t* to) {
  const auto eight = [&](int x) {
    // The bytes of the words apart, so that their sums fit into words.
    std::array<words8, 7> low, high;
    for (std::size_t i = 0; i != 7; ++i) {
      const auto v = loaded<words8>(rows[i] + x);
      low[i] = v & 255;
      high[i] = v >> 8;
    }
    return rounded_high(gaussian_sum(high), gaussian_sum(low));
  };
  for (int x = 0; x < count; x += 16) store16(to + x, joined(eight(x), eight(x + 8)));
}

#if ORBIS_X86
ORBIS_TARGET("avx2")
inline void smooth_along_avx2(const std::uint8_t* line, int count, std::uint16_t* sums) {
  const auto load = [&](const std::uint8_t* p)
                        ORBIS_TARGET("avx2") { return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p)); };
  const __m256i w01 = _mm256_set1_epi16(18 | 34 << 8), w23 = _mm256_set1_epi16(48 | 56 << 8);
  const __m256i w45 = _mm256_set1_epi16(48 | 34 << 8), w6 = _mm256_set1_epi16(18);
  // The next stage multiplies signed words.
  const __m256i to_signed = _mm256_set1_epi16(static_cast<short>(-0x8000));
  for (int x = 0; x < count; x += smooth_lanes) {
    const std::uint8_t* at = line + x;
    const __m256i a = load(at - 3), b = load(at - 2), c = load(at - 1), d = load(at);
    const __m256i e = load(at + 1), f = load(at + 2), g = load(at + 3), zero = _mm256_setzero_si256();
    const __m256i low = _mm256_add_epi16(_mm256_add_epi16(_mm256_maddubs_epi16(_mm256_unpacklo_epi8(a, b), w01),
                                                          _mm256_maddubs_epi16(_mm256_unpacklo_epi8(c, d), w23)),
                                         _mm256_add_epi16(_mm256_maddubs_epi16(_mm256_unpacklo_epi8(e, f), w45),
                                                          _mm256_maddubs_epi16(_mm256_unpacklo_epi8(g, zero), w6)));
    const __m256i high = _mm256_add_epi16(_mm256_add_epi16(_mm256_maddubs_epi16(_mm256_unpackhi_epi8(a, b), w01),
                                                           _mm256_maddubs_epi16(_mm256_unpackhi_epi8(c, d), w23)),
                                          _mm256_add_epi16(_mm256_maddubs_epi16(_mm256_unpackhi_epi8(e, f), w45),
                                                           _mm256_maddubs_epi16(_mm256_unpackhi_epi8(g, zero), w6)));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(sums + x), _mm256_xor_si256(low, to_signed));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(sums + x + 16), _mm256_xor_si256(high, to_signed));
  }
}

ORBIS_TARGET("avx2")
inline void smooth_across_avx2(const std::array<const std::uint16_t*, 7>& rows, int count, std::uint8_t* to) {
  const __m256i w01 = _mm256_set1_epi32(18 | 34 << 16), w23 = _mm256_set1_epi32(48 | 56 << 16);
  const __m256i w45 = _mm256_set1_epi32(48 | 34 << 16), w6 = _mm256_set1_epi32(18);
  const __m256i bias = _mm256_set1_epi32(0x8000 * 256 + 0x8000);  // back to unsigned, and half for rounding
  const auto half = [&](int x) ORBIS_TARGET("avx2") {
    const auto load = [&](std::size_t i) ORBIS_TARGET("avx2") {
      return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(rows[i] + x));
    };
    const __m256i a = load(0), b = load(1), c = load(2), d = load(3), e = load(4), f = load(5), g = load(6);
    const __m256i zero = _mm256_setzero_si256();
    const __m256i low = _mm256_add_epi32(_mm256_add_epi32(_mm256_madd_epi16(_mm256_unpacklo_epi16(a, b), w01),
                                                          _mm256_madd_epi16(_mm256_unpacklo_epi16(c, d), w23)),
                                         _mm256_add_epi32(_mm256_madd_epi16(_mm256_unpacklo_epi16(e, f), w45),
                                                          _mm256_madd_epi16(_mm256_unpacklo_epi16(g, zero), w6)));
    const __m256i high = _mm256_add_epi32(_mm256_add_epi32(_mm256_madd_epi16(_mm256_unpackhi_epi16(a, b), w01),
                                                           _mm256_madd_epi16(_mm256_unpackhi_epi16(c, d), w23)),
                                          _mm256_add_epi32(_mm256_madd_epi16(_mm256_unpackhi_epi16(e, f), w45),
                                                           _mm256_madd_epi16(_mm256_unpackhi_epi16(g, zero), w6)));
    return _mm256_packus_epi32(_mm256_srli_epi32(_mm256_add_epi32(low, bias), 16),
                               _mm256_srli_epi32(_mm256_add_epi32(high, bias), 16));
  };
  for (int x = 0; x < count; x += smooth_lanes)
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to + x), _mm256_packus_epi16(half(x), half(x + 16)));
}
#endif

/// Convolves rows `[first, last)` of an image with the 7x7 Gaussian of sigma 2, weights in 1/256, with one
/// rounding at the end; beyond the edge the image is its reflection (without the edge itself). The same bits
/// as OpenCV's GaussianBlur with these parameters, at every level. O(pixels).
/// @pre width >= 4, height >= 4; `to` has the size of `from`, and its rows may be written up to a
///      multiple of 32 pixels (at the end of the last one, too)
inline void smooth(simd::level level, image_view<const std::uint8_t> from, image_view<std::uint8_t> to, int first,
                   int last, smooth_workspace& memory) {
  const int width = from.width(), height = from.height();
  assert(width >= 4 && height >= 4 && to.width() == width && to.height() == height);
  assert(first >= 0 && last <= height);
#if ORBIS_X86
  const auto along = simd::select<smooth_along>(level, {.portable = smooth_along_portable, .avx2 = smooth_along_avx2});
  const auto across =
      simd::select<smooth_across>(level, {.portable = smooth_across_portable, .avx2 = smooth_across_avx2});
#else
  const auto along = smooth_along_portable;
  const auto across = smooth_across_portable;
#endif
  const auto padded = (static_cast<std::size_t>(width) + smooth_lanes - 1) / smooth_lanes * smooth_lanes;
  memory.line.resize(std::max(memory.line.size(), padded + 16 + smooth_lanes));
  memory.sums.resize(std::max(memory.sums.size(), padded * 8));
  const auto sums_of = [&](int y) { return memory.sums.data() + static_cast<std::size_t>(y & 7) * padded; };
  const auto reflected = [](int at, int size) { return at < 0 ? -at : at >= size ? 2 * size - 2 - at : at; };

  std::uint8_t* line = memory.line.data() + 16;
  int ready = std::max(0, first - 3);  // sums of rows before this one are there
  for (int y = first; y < last; ++y) {
    for (; ready <= std::min(y + 3, height - 1); ++ready) {
      std::memcpy(line, from.row(ready).data(), static_cast<std::size_t>(width));
      for (int i = 1; i <= 3; ++i) {
        line[-i] = line[i];
        line[width - 1 + i] = line[width - 1 - i];
      }
      along(line, width, sums_of(ready));
    }
    std::array<const std::uint16_t*, 7> rows;
    for (int i = 0; i != 7; ++i) rows[static_cast<std::size_t>(i)] = sums_of(reflected(y + i - 3, height));
    across(rows, width, to.data() + y * to.stride());
  }
}

}  // namespace orbis::features::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bilinear shrinking of 8-bit images, exact in fixed point.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/features/detail/extract/lanes16.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::features::detail {

/// Between which two pixels a pixel of the result lies; `weight` of the second in 1/256.
struct resize_tap {
  int first = 0;
  int second = 0;
  std::uint16_t weight = 0;
};

/// Pixels are areas with centres at integers: result pixel i lies at (i + 1/2) from / to - 1/2.
[[nodiscard]] inline resize_tap tap_at(int i, int from, int to) {
  const double at = (i + 0.5) * (static_cast<double>(from) / to) - 0.5;
  const double whole = std::floor(at);
  const int first = static_cast<int>(whole);
  if (first < 0) return {0, 0, 0};
  if (first >= from - 1) return {from - 1, from - 1, 0};
  return {first, first + 1, static_cast<std::uint16_t>(std::lrint((at - whole) * 256.0))};
}

/// Eight neighbouring pixels of a result that lie within sixteen of the source.
struct alignas(16) resize_group {
  std::array<std::uint8_t, 16> first;  ///< byte shuffle, each to the low half of a word
  std::array<std::uint8_t, 16> second;
  std::int32_t base = 0;  ///< where the sixteen begin
};

/// How to get from one width to another; made once, used for any number of images.
struct resize_plan {
  int from = 0, to = 0;  ///< widths
  // Of each pixel of the result, up to a whole number of vectors: between `first` and the pixel after it.
  std::vector<std::int32_t> first;
  std::vector<std::uint16_t> weight;  ///< of the pixel after it, in 1/256
  std::vector<resize_group> groups;   ///< empty if the step is too large for them
};

/// Memory that `resize` uses again and again.
struct resize_workspace {
  resize_plan plan;
  std::vector<std::uint16_t> rows;  ///< two of the source, shrunk horizontally
};

using resize_along = void(const resize_plan& plan, const std::uint8_t* from, std::uint16_t* to);
using resize_across = void(const std::uint16_t* first, const std::uint16_t* second, int weight, int count,
                           std::uint8_t* to);

inline constexpr int resize_lanes = 16;

inline void make_plan(resize_plan& plan, int from, int to) {
  if (plan.from == from && plan.to == to) return;
  plan.from = from;
  plan.to = to;
  plan.first.clear();
  plan.weight.clear();
  plan.groups.clear();
  if (from < 2) return;
  const int padded = (to + resize_lanes - 1) / resize_lanes * resize_lanes;
  for (int i = 0; i != padded; ++i) {
    const resize_tap t = tap_at(std::min(i, to - 1), from, to);
    const bool last = t.first == from - 1;  // as one before it, with all the weight on the second
    plan.first.push_back(last ? from - 2 : t.first);
    plan.weight.push_back(last ? std::uint16_t{256} : t.weight);
  }
  if (from < 16) return;
  for (std::size_t g = 0; g != plan.first.size(); g += 8) {
    resize_group group;
    group.base = std::min(plan.first[g], from - 16);
    if (plan.first[g + 7] + 1 - group.base > 15) return plan.groups.clear();
    for (std::size_t i = 0; i != 8; ++i) {
      const int at = plan.first[g + i] - group.base;
      group.first[2 * i] = static_cast<std::uint8_t>(at);
      group.second[2 * i] = static_cast<std::uint8_t>(at + 1);
      group.first[2 * i + 1] = group.second[2 * i + 1] = 0x80;  // zero
    }
    plan.groups.push_back(group);
  }
}

inline void resize_along_portable(const resize_plan& plan, const std::uint8_t* from, std::uint16_t* to) {
  if (plan.from == 1) return static_cast<void>(std::fill_n(to, plan.to, static_cast<std::uint16_t>(from[0] * 256)));
  for (std::size_t x = 0; x != plan.first.size(); x += 8) {
    words8 pairs;
    for (std::size_t i = 0; i != 8; ++i) {
      std::uint16_t pair;
      std::memcpy(&pair, from + plan.first[x + i], sizeof pair);
      pairs[i] = pair;
    }
    words8 first = pairs & 255, second = pairs >> 8;
    if constexpr (std::endian::native == std::endian::big) std::swap(first, second);
    // Modulo 2^16, in which the result fits: the difference may be negative.
    store(to + x, (first << 8) + (second - first) * loaded<words8>(plan.weight.data() + x));
  }
}

inline void resize_across_portable(const std::uint16_t* first, const std::uint16_t* second, int weight, int count,
                                   std::uint8_t* to) {
  const auto w1 = static_cast<std::uint16_t>(weight), w0 = static_cast<std::uint16_t>(256 - weight);
  for (int x = 0; x < count; x += 8) {
    const auto a = loaded<words8>(first + x), b = loaded<words8>(second + x);
    const words8 high = (a >> 8) * w0 + (b >> 8) * w1, low = (a & 255) * w0 + (b & 255) * w1;
    store8_narrowed(to + x, rounded_high(high, low));
  }
}

#if ORBIS_X86
ORBIS_TARGET("avx2")
inline void resize_along_avx2(const resize_plan& plan, const std::uint8_t* from, std::uint16_t* to) {
  if (plan.groups.empty()) return resize_along_portable(plan, from, to);
  for (std::size_t g = 0; g != plan.groups.size(); g += 2) {
    const resize_group &a = plan.groups[g], &b = plan.groups[g + 1];
    const auto both = [&](const void* low, const void* high) ORBIS_TARGET("avx2") {
      return _mm256_inserti128_si256(_mm256_castsi128_si256(_mm_loadu_si128(static_cast<const __m128i*>(low))),
                                     _mm_loadu_si128(static_cast<const __m128i*>(high)), 1);
    };
    const __m256i pixels = both(from + a.base, from + b.base);
    const __m256i first = _mm256_shuffle_epi8(pixels, both(a.first.data(), b.first.data()));
    const __m256i second = _mm256_shuffle_epi8(pixels, both(a.second.data(), b.second.data()));
    const __m256i weight = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(plan.weight.data() + 8 * g));
    const __m256i step = _mm256_mullo_epi16(_mm256_sub_epi16(second, first), weight);
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to + 8 * g), _mm256_add_epi16(_mm256_slli_epi16(first, 8), step));
  }
}

ORBIS_TARGET("avx2")
inline void resize_across_avx2(const std::uint16_t* first, const std::uint16_t* second, int weight, int count,
                               std::uint8_t* to) {
  const __m256i weights = _mm256_set1_epi32((256 - weight) | weight << 16);
  const __m256i to_signed = _mm256_set1_epi16(static_cast<short>(-0x8000));
  const __m256i bias = _mm256_set1_epi32(0x8000 * 256 + 0x8000);
  for (int x = 0; x < count; x += resize_lanes) {
    const auto load = [&](const std::uint16_t* p) ORBIS_TARGET("avx2") {
      return _mm256_xor_si256(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(p + x)), to_signed);
    };
    const __m256i a = load(first), b = load(second);
    const __m256i low = _mm256_add_epi32(_mm256_madd_epi16(_mm256_unpacklo_epi16(a, b), weights), bias);
    const __m256i high = _mm256_add_epi32(_mm256_madd_epi16(_mm256_unpackhi_epi16(a, b), weights), bias);
    const __m256i words = _mm256_packus_epi32(_mm256_srli_epi32(low, 16), _mm256_srli_epi32(high, 16));
    const __m128i bytes = _mm_packus_epi16(_mm256_castsi256_si128(words), _mm256_extracti128_si256(words, 1));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(to + x), bytes);
  }
}
#endif

/// Shrinks (or enlarges) an image to the size of `to` by bilinear interpolation: weights in 1/256, one
/// rounding at the end. The same bits as OpenCV's INTER_LINEAR_EXACT, at every level. Fast for
/// factors up to 1.8. Shrinking by more than 2 leaves pixels out. O(pixels of both).
/// @pre neither image is empty; the rows of `to` may be written up to a multiple of 16 pixels (at
///      the end of the last one, too)
inline void resize(simd::level level, image_view<const std::uint8_t> from, image_view<std::uint8_t> to,
                   resize_workspace& memory) {
  assert(!from.empty() && !to.empty());
#if ORBIS_X86
  const auto along = simd::select<resize_along>(level, {.portable = resize_along_portable, .avx2 = resize_along_avx2});
  const auto across =
      simd::select<resize_across>(level, {.portable = resize_across_portable, .avx2 = resize_across_avx2});
#else
  const auto along = resize_along_portable;
  const auto across = resize_across_portable;
#endif
  make_plan(memory.plan, from.width(), to.width());
  const auto padded = (static_cast<std::size_t>(to.width()) + resize_lanes - 1) / resize_lanes * resize_lanes;
  memory.rows.resize(std::max(memory.rows.size(), 2 * padded));
  std::array<int, 2> holds{-1, -1};  // which source rows stand in memory.rows; even ones in the first
  const auto row_of = [&](int y) {
    const auto slot = static_cast<std::size_t>(y & 1);
    std::uint16_t* row = memory.rows.data() + slot * padded;
    if (holds[slot] != y) along(memory.plan, from.row(y).data(), row);
    holds[slot] = y;
    return row;
  };
  for (int y = 0; y != to.height(); ++y) {
    const resize_tap tap = tap_at(y, from.height(), to.height());
    const std::uint16_t* first = row_of(tap.first);
    across(first, row_of(tap.second), tap.weight, to.width(), to.data() + y * to.stride());
  }
}

}  // namespace orbis::features::detail

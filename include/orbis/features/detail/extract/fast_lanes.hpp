// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// FAST-9/16 scores of many pixels at once; the insides of `fast9`.
///
/// The score of a pixel is the largest step by which nine contiguous pixels of the circle around it
/// are all brighter, or all darker, than the pixel: max over arcs of min over the arc. Every arc of
/// nine holds one of the eight arcs of eight that start at an odd pixel, plus the pixel before or
/// after it, so that eight arcs, each built by doubling, give all sixteen. No lane ever branches.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <orbis/core/simd.hpp>
#include <orbis/features/detail/extract/lanes16.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::features::detail {

inline constexpr int circle_radius = 3;
/// The circle, clockwise from the top.
inline constexpr std::array<int, 16> circle_x{0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
inline constexpr std::array<int, 16> circle_y{-3, -3, -2, -1, 0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3};

[[nodiscard]] inline std::array<std::ptrdiff_t, 16> circle_offsets(std::ptrdiff_t stride) noexcept {
  std::array<std::ptrdiff_t, 16> offsets{};
  for (std::size_t i = 0; i != 16; ++i) offsets[i] = circle_y[i] * stride + circle_x[i];
  return offsets;
}

/// Writes the scores of `count` pixels of a row, 0 for those that do not exceed `threshold`.
/// @pre the circles around all of them are readable
using fast_scores = void(const std::uint8_t* centre, std::ptrdiff_t stride, int count, std::uint8_t threshold,
                         std::uint8_t* scores);

/// Writes the columns of the scores that are larger than their eight neighbours, ascending; returns how many.
/// With `ties`, those before it by row, then column, may be equal.
/// @pre 64 bytes before the rows and after their `count` ones are readable and zero
using fast_peaks = std::size_t(const std::uint8_t* above, const std::uint8_t* row, const std::uint8_t* below, int count,
                               bool ties, std::uint32_t* columns);

/// One pixel, as the definition says.
[[nodiscard]] inline int fast_score(const std::uint8_t* centre, const std::array<std::ptrdiff_t, 16>& circle) noexcept {
  int best = 0;
  for (std::size_t start = 0; start != 16; ++start) {
    int darkest = 255, brightest = 0;
    for (std::size_t i = 0; i != 9; ++i) {
      const int p = centre[circle[(start + i) % 16]];
      darkest = p < darkest ? p : darkest;
      brightest = p > brightest ? p : brightest;
    }
    const int brighter = darkest - *centre, darker = *centre - brightest;
    best = brighter > best ? brighter : best;
    best = darker > best ? darker : best;
  }
  return best;
}

inline void fast_scores_one_by_one(const std::uint8_t* centre, std::ptrdiff_t stride, int count, std::uint8_t threshold,
                                   std::uint8_t* scores) {
  const auto circle = circle_offsets(stride);
  for (int x = 0; x != count; ++x) {
    const int score = fast_score(centre + x, circle);
    scores[x] = static_cast<std::uint8_t>(score > threshold ? score : 0);
  }
}

inline void fast_scores_portable(const std::uint8_t* centre, std::ptrdiff_t stride, int count, std::uint8_t threshold,
                                 std::uint8_t* scores) {
  const auto circle = circle_offsets(stride);
  const bytes16 least = bytes16{} + threshold;
  const auto block = [&](int x) {
    const std::uint8_t* at = centre + x;
    const bytes16 c = load16(at);
    // Every arc of nine has a pixel of each pair of opposites.
    bytes16 pair_max = bytes16{} + std::uint8_t{255}, pair_min{};
    for (std::size_t i = 0; i != 8; i += 2) {
      const bytes16 a = load16(at + circle[i]), b = load16(at + circle[i + 8]);
      pair_max = min16(pair_max, max16(a, b));
      pair_min = max16(pair_min, min16(a, b));
    }
    const bytes16 bound = max16(max16(pair_max, c) - c, c - min16(c, pair_min));
    bytes16 score{};
    if (any16(max16(bound, least) - least)) {
      std::array<bytes16, 16> p;
      for (std::size_t i = 0; i != 16; ++i) p[i] = load16(at + circle[i]);
      std::array<bytes16, 8> low, high;
      for (std::size_t k = 0; k != 8; ++k) {
        low[k] = min16(p[2 * k + 1], p[(2 * k + 2) % 16]);
        high[k] = max16(p[2 * k + 1], p[(2 * k + 2) % 16]);
      }
      bytes16 brightest{}, darkest = bytes16{} + std::uint8_t{255};
      for (std::size_t k = 0; k != 8; ++k) {
        const bytes16 low8 = min16(min16(low[k], low[(k + 1) % 8]), min16(low[(k + 2) % 8], low[(k + 3) % 8]));
        const bytes16 high8 = max16(max16(high[k], high[(k + 1) % 8]), max16(high[(k + 2) % 8], high[(k + 3) % 8]));
        brightest = max16(brightest, min16(low8, max16(p[2 * k], p[(2 * k + 9) % 16])));
        darkest = min16(darkest, max16(high8, min16(p[2 * k], p[(2 * k + 9) % 16])));
      }
      score = max16(max16(brightest, c) - c, c - min16(c, darkest));
      score = (score > least) ? score : bytes16{};
    }
    store16(scores + x, score);
  };
  if (count < 16) return fast_scores_one_by_one(centre, stride, count, threshold, scores);
  for (int x = 0; x <= count - 16; x += 16) block(x);
  if (count % 16 != 0) block(count - 16);  // overlaps the one before it
}

inline std::size_t fast_peaks_portable(const std::uint8_t* above, const std::uint8_t* row, const std::uint8_t* below,
                                       int count, bool ties, std::uint32_t* columns) {
  const std::uint8_t lower = ties ? 1 : 0;
  const bytes16 allowed = bytes16{} + lower;
  std::size_t found = 0;
  for (int x = 0; x < count; x += 16) {
    const bytes16 s = load16(row + x);
    if (!any16(s)) continue;
    const bytes16 before =
        max16(max16(load16(above + x - 1), load16(above + x)), max16(load16(above + x + 1), load16(row + x - 1)));
    const bytes16 after =
        max16(max16(load16(below + x - 1), load16(below + x)), max16(load16(below + x + 1), load16(row + x + 1)));
    const bytes16 bound = max16(after, max16(before, allowed) - allowed);  // s >= before: s > before - 1
    std::uint32_t peaks = bits16(std::bit_cast<bytes16>(s > bound));
    for (; peaks != 0; peaks &= peaks - 1) columns[found++] = static_cast<std::uint32_t>(x + std::countr_zero(peaks));
  }
  return found;
}

#if ORBIS_X86
ORBIS_TARGET("avx2")
inline void fast_scores_avx2(const std::uint8_t* centre, std::ptrdiff_t stride, int count, std::uint8_t threshold,
                             std::uint8_t* scores) {
  const auto circle = circle_offsets(stride);
  const __m256i least = _mm256_set1_epi8(static_cast<char>(threshold));
  const auto load = [&](const std::uint8_t* p)
                        ORBIS_TARGET("avx2") { return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p)); };
  const auto block = [&](int x) ORBIS_TARGET("avx2") {
    const std::uint8_t* at = centre + x;
    const __m256i c = load(at);
    __m256i pair_max = _mm256_set1_epi8(-1), pair_min = _mm256_setzero_si256();
#pragma GCC unroll 4
    for (std::size_t i = 0; i != 8; i += 2) {
      const __m256i a = load(at + circle[i]), b = load(at + circle[i + 8]);
      pair_max = _mm256_min_epu8(pair_max, _mm256_max_epu8(a, b));
      pair_min = _mm256_max_epu8(pair_min, _mm256_min_epu8(a, b));
    }
    const __m256i bound = _mm256_or_si256(_mm256_subs_epu8(_mm256_subs_epu8(pair_max, c), least),
                                          _mm256_subs_epu8(_mm256_subs_epu8(c, pair_min), least));
    __m256i score = _mm256_setzero_si256();
    if (!_mm256_testz_si256(bound, bound)) {
      __m256i p[16], low[8], high[8];
#pragma GCC unroll 16
      for (std::size_t i = 0; i != 16; ++i) p[i] = load(at + circle[i]);
#pragma GCC unroll 8
      for (std::size_t k = 0; k != 8; ++k) {
        low[k] = _mm256_min_epu8(p[2 * k + 1], p[(2 * k + 2) % 16]);
        high[k] = _mm256_max_epu8(p[2 * k + 1], p[(2 * k + 2) % 16]);
      }
      __m256i brightest = score, darkest = _mm256_set1_epi8(-1);
#pragma GCC unroll 8
      for (std::size_t k = 0; k != 8; ++k) {
        const __m256i low8 = _mm256_min_epu8(_mm256_min_epu8(low[k], low[(k + 1) % 8]),
                                             _mm256_min_epu8(low[(k + 2) % 8], low[(k + 3) % 8]));
        const __m256i high8 = _mm256_max_epu8(_mm256_max_epu8(high[k], high[(k + 1) % 8]),
                                              _mm256_max_epu8(high[(k + 2) % 8], high[(k + 3) % 8]));
        const __m256i a = p[2 * k], b = p[(2 * k + 9) % 16];
        brightest = _mm256_max_epu8(brightest, _mm256_min_epu8(low8, _mm256_max_epu8(a, b)));
        darkest = _mm256_min_epu8(darkest, _mm256_max_epu8(high8, _mm256_min_epu8(a, b)));
      }
      score = _mm256_max_epu8(_mm256_subs_epu8(brightest, c), _mm256_subs_epu8(c, darkest));
      // Where subtracting the threshold leaves nothing, there is no corner.
      score = _mm256_andnot_si256(_mm256_cmpeq_epi8(_mm256_subs_epu8(score, least), _mm256_setzero_si256()), score);
    }
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(scores + x), score);
  };
  if (count < 32) return fast_scores_portable(centre, stride, count, threshold, scores);
  for (int x = 0; x <= count - 32; x += 32) block(x);
  if (count % 32 != 0) block(count - 32);
}

ORBIS_TARGET("avx2,bmi")
inline std::size_t fast_peaks_avx2(const std::uint8_t* above, const std::uint8_t* row, const std::uint8_t* below,
                                   int count, bool ties, std::uint32_t* columns) {
  const auto load = [&](const std::uint8_t* p)
                        ORBIS_TARGET("avx2,bmi") { return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p)); };
  const __m256i zero = _mm256_setzero_si256(), allowed = _mm256_set1_epi8(ties ? 1 : 0);
  std::size_t found = 0;
  for (int x = 0; x < count; x += 32) {
    const __m256i s = load(row + x);
    if (_mm256_testz_si256(s, s)) continue;
    const __m256i before = _mm256_max_epu8(_mm256_max_epu8(load(above + x - 1), load(above + x)),
                                           _mm256_max_epu8(load(above + x + 1), load(row + x - 1)));
    const __m256i after = _mm256_max_epu8(_mm256_max_epu8(load(below + x - 1), load(below + x)),
                                          _mm256_max_epu8(load(below + x + 1), load(row + x + 1)));
    const __m256i bound = _mm256_max_epu8(after, _mm256_subs_epu8(before, allowed));
    const __m256i larger = _mm256_subs_epu8(s, bound);
    auto peaks = ~static_cast<std::uint32_t>(_mm256_movemask_epi8(_mm256_cmpeq_epi8(larger, zero)));
    for (; peaks != 0; peaks &= peaks - 1) columns[found++] = static_cast<std::uint32_t>(x + std::countr_zero(peaks));
  }
  return found;
}

ORBIS_TARGET("avx2,avx512f,avx512bw,avx512vl")
inline void fast_scores_avx512(const std::uint8_t* centre, std::ptrdiff_t stride, int count, std::uint8_t threshold,
                               std::uint8_t* scores) {
#define ORBIS_FAST_AVX512 ORBIS_TARGET("avx2,avx512f,avx512bw,avx512vl")
  // g++ 12 warns of an uninitialised value in the variants without a mask.
  const auto load = [&](const std::uint8_t* p) ORBIS_FAST_AVX512 { return _mm512_loadu_si512(p); };
  const auto min = [&](__m512i a, __m512i b) ORBIS_FAST_AVX512 { return _mm512_maskz_min_epu8(~__mmask64{}, a, b); };
  const auto max = [&](__m512i a, __m512i b) ORBIS_FAST_AVX512 { return _mm512_maskz_max_epu8(~__mmask64{}, a, b); };
  const auto circle = circle_offsets(stride);
  const __m512i least = _mm512_set1_epi8(static_cast<char>(threshold));
  const auto block = [&](int x) ORBIS_FAST_AVX512 {
    const std::uint8_t* at = centre + x;
    const __m512i c = load(at);
    __m512i pair_max = _mm512_set1_epi8(-1), pair_min = _mm512_setzero_si512();
#pragma GCC unroll 4
    for (std::size_t i = 0; i != 8; i += 2) {
      const __m512i a = load(at + circle[i]), b = load(at + circle[i + 8]);
      pair_max = min(pair_max, max(a, b));
      pair_min = max(pair_min, min(a, b));
    }
    const __mmask64 hopeful = _mm512_cmpgt_epu8_mask(_mm512_subs_epu8(pair_max, c), least) |
                              _mm512_cmpgt_epu8_mask(_mm512_subs_epu8(c, pair_min), least);
    __m512i score = _mm512_setzero_si512();
    if (hopeful != 0) {
      __m512i p[16], low[8], high[8];
#pragma GCC unroll 16
      for (std::size_t i = 0; i != 16; ++i) p[i] = load(at + circle[i]);
#pragma GCC unroll 8
      for (std::size_t k = 0; k != 8; ++k) {
        low[k] = min(p[2 * k + 1], p[(2 * k + 2) % 16]);
        high[k] = max(p[2 * k + 1], p[(2 * k + 2) % 16]);
      }
      __m512i brightest = score, darkest = _mm512_set1_epi8(-1);
#pragma GCC unroll 8
      for (std::size_t k = 0; k != 8; ++k) {
        const __m512i low8 = min(min(low[k], low[(k + 1) % 8]), min(low[(k + 2) % 8], low[(k + 3) % 8]));
        const __m512i high8 = max(max(high[k], high[(k + 1) % 8]), max(high[(k + 2) % 8], high[(k + 3) % 8]));
        const __m512i a = p[2 * k], b = p[(2 * k + 9) % 16];
        brightest = max(brightest, min(low8, max(a, b)));
        darkest = min(darkest, max(high8, min(a, b)));
      }
      score = max(_mm512_subs_epu8(brightest, c), _mm512_subs_epu8(c, darkest));
      score = _mm512_maskz_mov_epi8(_mm512_cmpgt_epu8_mask(score, least), score);
    }
    _mm512_storeu_si512(scores + x, score);
  };
  if (count < 64) return fast_scores_avx2(centre, stride, count, threshold, scores);
  for (int x = 0; x <= count - 64; x += 64) block(x);
  if (count % 64 != 0) block(count - 64);
#undef ORBIS_FAST_AVX512
}
#endif

}  // namespace orbis::features::detail

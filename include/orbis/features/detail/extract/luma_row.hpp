// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The luma of a row of colour pixels.
#pragma once

#include <cstddef>
#include <cstdint>

#include <orbis/core/image.hpp>
#include <orbis/core/simd/dispatch.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::features::detail {

/// Rec. 601 luma, in 1/32768.
inline constexpr int luma_red = 9798, luma_green = 19235, luma_blue = 3735;

#if ORBIS_X86
/// Thirty-two pixels at a time; returns how many are done, all but the last few.
ORBIS_TARGET_AVX2 inline int luma_blocks(const rgb8* from, int count, std::uint8_t* to) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(from);
  constexpr char o = -128;  // zero
  const __m256i red_green = _mm256_broadcastsi128_si256(_mm_setr_epi8(0, o, 1, o, 3, o, 4, o, 6, o, 7, o, 9, o, 10, o));
  const __m256i blue = _mm256_broadcastsi128_si256(_mm_setr_epi8(2, o, o, o, 5, o, o, o, 8, o, o, o, 11, o, o, o));
  const __m256i red_green_weights = _mm256_set1_epi32(luma_red | luma_green << 16);
  const __m256i blue_weight = _mm256_set1_epi32(luma_blue), half = _mm256_set1_epi32(1 << 14);
  // Eight pixels; reads four bytes beyond them.
  const auto eight = [&](const std::uint8_t* p) ORBIS_TARGET_AVX2 {
    const __m256i v =
        _mm256_inserti128_si256(_mm256_castsi128_si256(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p))),
                                _mm_loadu_si128(reinterpret_cast<const __m128i*>(p + 12)), 1);
    const __m256i rg = _mm256_madd_epi16(_mm256_shuffle_epi8(v, red_green), red_green_weights);
    const __m256i b = _mm256_madd_epi16(_mm256_shuffle_epi8(v, blue), blue_weight);
    return _mm256_srli_epi32(_mm256_add_epi32(_mm256_add_epi32(rg, b), half), 15);
  };
  const __m256i in_order = _mm256_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7);
  int x = 0;
  for (; x <= count - 34; x += 32) {
    const std::uint8_t* p = bytes + 3 * static_cast<std::ptrdiff_t>(x);
    const __m256i words = _mm256_packus_epi16(_mm256_packus_epi32(eight(p), eight(p + 24)),
                                              _mm256_packus_epi32(eight(p + 48), eight(p + 72)));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to + x), _mm256_permutevar8x32_epi32(words, in_order));
  }
  return x;
}
#endif

struct luma_kernel {
  using signature = void(const rgb8* from, int count, std::uint8_t* to);
  template <class Target>
  static ORBIS_ALWAYS_INLINE void run(const rgb8* from, int count, std::uint8_t* to) {
    int x = 0;
#if ORBIS_X86
    if constexpr (Target::needs >= simd::level::avx2) x = luma_blocks(from, count, to);
#endif
    for (; x < count; ++x)
      to[x] = static_cast<std::uint8_t>(
          (from[x].r * luma_red + from[x].g * luma_green + from[x].b * luma_blue + (1 << 14)) >> 15);
  }
};

}  // namespace orbis::features::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The (1, 2, 1) / 4 mean of three rows of bytes; the insides of slight smoothing.
#pragma once

#include <cstdint>

#include <orbis/core/simd.hpp>
#include <orbis/features/detail/extract/lanes16.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::features::detail {

/// to[x] = (a[x] + 2 b[x] + c[x] + 2) / 4. @pre `to` overlaps none of the others
using binomial_row = void(const std::uint8_t* a, const std::uint8_t* b, const std::uint8_t* c, int count,
                          std::uint8_t* to);

inline void binomial_row_portable(const std::uint8_t* a, const std::uint8_t* b, const std::uint8_t* c, int count,
                                  std::uint8_t* to) {
  const auto block = [&](int x) {
    const bytes16 va = load16(a + x), vb = load16(b + x), vc = load16(c + x);
    // The mean of a and c, rounded down; then with b, rounded up: together that is the rounding wanted.
    const bytes16 ac = (va & vc) + ((va ^ vc) >> 1);
    store16(to + x, (ac | vb) - ((ac ^ vb) >> 1));
  };
  if (count < 16) {
    for (int x = 0; x < count; ++x) to[x] = static_cast<std::uint8_t>((a[x] + 2 * b[x] + c[x] + 2) >> 2);
    return;
  }
  for (int x = 0; x <= count - 16; x += 16) block(x);
  if (count % 16 != 0) block(count - 16);  // overlaps the one before it
}

#if ORBIS_X86
ORBIS_TARGET("avx2")
inline void binomial_row_avx2(const std::uint8_t* a, const std::uint8_t* b, const std::uint8_t* c, int count,
                              std::uint8_t* to) {
  const __m256i one = _mm256_set1_epi8(1);
  const auto block = [&](int x) ORBIS_TARGET("avx2") {
    const auto load = [&](const std::uint8_t* p)
                          ORBIS_TARGET("avx2") { return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p + x)); };
    const __m256i va = load(a), vc = load(c);
    const __m256i ac = _mm256_sub_epi8(_mm256_avg_epu8(va, vc), _mm256_and_si256(_mm256_xor_si256(va, vc), one));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to + x), _mm256_avg_epu8(ac, load(b)));
  };
  if (count < 32) return binomial_row_portable(a, b, c, count, to);
  for (int x = 0; x <= count - 32; x += 32) block(x);
  if (count % 32 != 0) block(count - 32);  // overlaps the one before it
}
#endif

}  // namespace orbis::features::detail

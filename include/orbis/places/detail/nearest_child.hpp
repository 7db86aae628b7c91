// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The nearest of a few descriptors that lie side by side, by run-time dispatched kernels.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <orbis/core/bit_string.hpp>
#include <orbis/core/bits.hpp>
#include <orbis/core/simd.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::places::detail {

/// The nearest of `count` children, the first of equals. @pre count > 0
template <class Ops, std::size_t Bits>
[[nodiscard, gnu::always_inline]] inline std::uint32_t nearest_by_words(const bit_words<Bits>& query,
                                                                        const bit_words<Bits>* children,
                                                                        std::uint32_t count) noexcept {
  // Distance and index in one number: the least is found without a branch that cannot be foreseen.
  std::uint32_t best = ~std::uint32_t{0};
  for (std::uint32_t c = 0; c != count; ++c) {
    std::uint32_t distance = 0;
    for (std::size_t w = 0; w != Bits / 64; ++w) distance += Ops::ones(query[w] ^ children[c][w]);
    best = std::min(best, distance << 16U | c);
  }
  return best & 0xffffU;
}

struct nearest_portable {
  [[nodiscard]] static std::uint32_t ones(std::uint64_t x) noexcept { return count_ones(x); }
  template <std::size_t Bits>
  [[nodiscard]] static std::uint32_t nearest(const bit_words<Bits>& query, const bit_words<Bits>* children,
                                             std::uint32_t count) noexcept {
    return nearest_by_words<nearest_portable, Bits>(query, children, count);
  }
};

#if ORBIS_X86
struct nearest_popcnt {
  [[nodiscard]] ORBIS_TARGET("popcnt") static std::uint32_t ones(std::uint64_t x) noexcept {
    return static_cast<std::uint32_t>(__builtin_popcountll(x));
  }
  template <std::size_t Bits>
  [[nodiscard]] ORBIS_TARGET("popcnt") static std::uint32_t
      nearest(const bit_words<Bits>& query, const bit_words<Bits>* children, std::uint32_t count) noexcept {
    return nearest_by_words<nearest_popcnt, Bits>(query, children, count);
  }
};

/// One descriptor in each register, counted by table (W. Mula, N. Kurz, D. Lemire, "Faster population counts using
/// AVX2 instructions", The Computer Journal 2018).
struct nearest_avx2 {
  template <std::size_t Bits>
  [[nodiscard]] ORBIS_TARGET("avx2,popcnt") static std::uint32_t
      nearest(const bit_words<Bits>& query, const bit_words<Bits>* children, std::uint32_t count) noexcept {
    if constexpr (Bits != 256) {
      return nearest_by_words<nearest_popcnt, Bits>(query, children, count);
    } else {
      const __m256i q = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(query.data()));
      const __m256i table = _mm256_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4, 0, 1, 1, 2, 1, 2, 2, 3, 1,
                                             2, 2, 3, 2, 3, 3, 4);
      const __m256i low = _mm256_set1_epi8(0x0f);
      std::uint32_t best = ~std::uint32_t{0};
      for (std::uint32_t c = 0; c != count; ++c) {
        const __m256i v = _mm256_xor_si256(q, _mm256_loadu_si256(reinterpret_cast<const __m256i*>(children + c)));
        const __m256i a = _mm256_shuffle_epi8(table, _mm256_and_si256(v, low));
        const __m256i b = _mm256_shuffle_epi8(table, _mm256_and_si256(_mm256_srli_epi16(v, 4), low));
        const __m256i s = _mm256_sad_epu8(_mm256_add_epi8(a, b), _mm256_setzero_si256());
        const __m128i t = _mm_add_epi64(_mm256_castsi256_si128(s), _mm256_extracti128_si256(s, 1));
        const auto d = static_cast<std::uint32_t>(_mm_cvtsi128_si32(_mm_add_epi64(t, _mm_unpackhi_epi64(t, t))));
        best = std::min(best, d << 16U | c);
      }
      return best & 0xffffU;
    }
  }
};
#endif

/// `nearest[i]` becomes the nearest centre of descriptor `i`.
template <std::size_t Bits>
struct assignment {
  const bit_words<Bits>* centres;
  std::uint32_t centre_count;
  const bit_words<Bits>* descriptors;
  std::size_t count;
  std::uint16_t* nearest;
};

template <class Ops, std::size_t Bits>
[[gnu::always_inline]] inline void assign_by(const assignment<Bits>& a) {
  for (std::size_t i = 0; i != a.count; ++i)
    a.nearest[i] = static_cast<std::uint16_t>(Ops::template nearest<Bits>(a.descriptors[i], a.centres, a.centre_count));
}
template <std::size_t Bits>
void assign_portable(const assignment<Bits>& a) {
  assign_by<nearest_portable>(a);
}
#if ORBIS_X86
template <std::size_t Bits>
ORBIS_TARGET("popcnt")
void assign_popcnt(const assignment<Bits>& a) {
  assign_by<nearest_popcnt>(a);
}
template <std::size_t Bits>
ORBIS_TARGET("popcnt,avx2")
void assign_avx2(const assignment<Bits>& a) {
  assign_by<nearest_avx2>(a);
}
#endif

/// Does it; the same at every level of instructions. @pre 0 < centre_count < 65536
template <std::size_t Bits>
void assign_nearest(simd::level level, const assignment<Bits>& a) {
#if ORBIS_X86
  simd::select<void(const assignment<Bits>&)>(
      level, {.portable = assign_portable<Bits>, .popcnt = assign_popcnt<Bits>, .avx2 = assign_avx2<Bits>})(a);
#else
  static_cast<void>(level);
  assign_portable(a);
#endif
}

/// Asks for the cache line at `p`.
[[gnu::always_inline]] inline void prefetch(const void* p) noexcept {
#if defined(__GNUC__)
  __builtin_prefetch(p);
#else
  static_cast<void>(p);
#endif
}

}  // namespace orbis::places::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Functions on integer vectors: saturated sums, averages, sums of products, narrowing in blocks, bit counts.
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <orbis/core/simd/convert.hpp>
#include <orbis/core/simd/shuffle.hpp>
#include <orbis/core/simd/vec.hpp>

namespace orbis::simd {

namespace detail {

#if ORBIS_X86
// Functions for registers of 16, 32 and 64 bytes; each uses one intrinsic for bytes and another for wider numbers. SSE2
// is the baseline, so the 16-byte functions need no attribute.
#define ORBIS_SIMD_BINARY(name, of_bytes, of_words)                                                     \
  template <class Out, class A, class B>                                                                \
  ORBIS_ALWAYS_INLINE void name##_16(Out& out, const A& a, const B& b) noexcept {                       \
    const auto x = reinterpret_cast<__m128i>(a), y = reinterpret_cast<__m128i>(b);                      \
    out = reinterpret_cast<Out>(sizeof(a[0]) == 1 ? _mm_##of_bytes(x, y) : _mm_##of_words(x, y));       \
  }                                                                                                     \
  template <class Out, class A, class B>                                                                \
  ORBIS_TARGET_AVX2 inline void name##_32(Out& out, const A& a, const B& b) noexcept {                  \
    const auto x = reinterpret_cast<__m256i>(a), y = reinterpret_cast<__m256i>(b);                      \
    out = reinterpret_cast<Out>(sizeof(a[0]) == 1 ? _mm256_##of_bytes(x, y) : _mm256_##of_words(x, y)); \
  }                                                                                                     \
  template <class Out, class A, class B>                                                                \
  ORBIS_TARGET_AVX512 inline void name##_64(Out& out, const A& a, const B& b) noexcept {                \
    const auto x = reinterpret_cast<__m512i>(a), y = reinterpret_cast<__m512i>(b);                      \
    out = reinterpret_cast<Out>(sizeof(a[0]) == 1 ? _mm512_##of_bytes(x, y) : _mm512_##of_words(x, y)); \
  }                                                                                                     \
  template <class Out, class A, class B>                                                                \
  ORBIS_ALWAYS_INLINE void name(Out& out, const A& a, const B& b) noexcept {                            \
    if constexpr (sizeof(a) == 64)                                                                      \
      name##_64(out, a, b);                                                                             \
    else if constexpr (sizeof(a) == 32)                                                                 \
      name##_32(out, a, b);                                                                             \
    else                                                                                                \
      name##_16(out, a, b);                                                                             \
  }
#else
#define ORBIS_SIMD_BINARY(name, of_bytes, of_words) \
  template <class Out, class A, class B>            \
  void name(Out& out, const A& a, const B& b) noexcept;
#endif
ORBIS_SIMD_BINARY(add_small, adds_epu8, adds_epu16)
ORBIS_SIMD_BINARY(subtract_small, subs_epu8, subs_epu16)
ORBIS_SIMD_BINARY(average_small, avg_epu8, avg_epu16)
ORBIS_SIMD_BINARY(add_products, madd_epi16, madd_epi16)
ORBIS_SIMD_BINARY(pack_words, packus_epi16, packus_epi16)
#undef ORBIS_SIMD_BINARY

#if ORBIS_X86
template <class Out, class A, class B>
ORBIS_TARGET_POPCNT inline void byte_products_16(Out& out, const A& a, const B& b) noexcept {
  out = reinterpret_cast<Out>(_mm_maddubs_epi16(reinterpret_cast<__m128i>(a), reinterpret_cast<__m128i>(b)));
}
template <class Out, class A, class B>
ORBIS_TARGET_AVX2 inline void byte_products_32(Out& out, const A& a, const B& b) noexcept {
  out = reinterpret_cast<Out>(_mm256_maddubs_epi16(reinterpret_cast<__m256i>(a), reinterpret_cast<__m256i>(b)));
}
template <class Out, class A, class B>
ORBIS_TARGET_AVX512 inline void byte_products_64(Out& out, const A& a, const B& b) noexcept {
  out = reinterpret_cast<Out>(_mm512_maddubs_epi16(reinterpret_cast<__m512i>(a), reinterpret_cast<__m512i>(b)));
}
template <class V>
ORBIS_TARGET_AVX2 inline void count_bits_32(V& out, const V& v) noexcept {
  const auto x = reinterpret_cast<__m256i>(v);
  const __m256i table =
      _mm256_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4, 0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4);
  const __m256i low = _mm256_set1_epi8(0x0f);
  const __m256i a = _mm256_shuffle_epi8(table, _mm256_and_si256(x, low));
  const __m256i b = _mm256_shuffle_epi8(table, _mm256_and_si256(_mm256_srli_epi16(x, 4), low));
  out = reinterpret_cast<V>(_mm256_sad_epu8(_mm256_add_epi8(a, b), _mm256_setzero_si256()));
}
template <class V>
ORBIS_TARGET_AVX512 inline void count_bits_64(V& out, const V& v) noexcept {
  const auto x = reinterpret_cast<__m512i>(v);
  const __m512i table =
      _mm512_maskz_broadcast_i32x4(0xffff, _mm_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4));
  const __m512i low = _mm512_set1_epi8(0x0f);
  const __m512i a = _mm512_shuffle_epi8(table, _mm512_and_si512(x, low));
  const __m512i b = _mm512_shuffle_epi8(table, _mm512_and_si512(_mm512_srli_epi16(x, 4), low));
  out = reinterpret_cast<V>(_mm512_sad_epu8(_mm512_add_epi8(a, b), _mm512_setzero_si512()));
}
#endif

/// Calls `instruction` for registers of at least 16 bytes on x86, otherwise `plain`.
template <class V, class I, class F>
[[nodiscard]] ORBIS_ALWAYS_INLINE V binary(const V& a, const V& b, const I& instruction, const F& plain) noexcept {
  if constexpr (!V::is_native) {
    return {binary(a.v.low, b.v.low, instruction, plain), binary(a.v.high, b.v.high, instruction, plain)};
  } else if constexpr (ORBIS_X86 && sizeof(a.v) >= 16) {
    V out;
    instruction(out.v, a.v, b.v);
    return out;
  } else {
    return plain(a, b);
  }
}

template <class T>
concept small_unsigned = std::same_as<T, std::uint8_t> || std::same_as<T, std::uint16_t>;

}  // namespace detail

/// Saturating addition: a + b, clamped to the maximum of the type.
template <detail::small_unsigned T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<T, N, Target> add_saturated(const vec<T, N, Target>& a,
                                                                  const vec<T, N, Target>& b) noexcept {
  return detail::binary(
      a, b, [](auto& out, const auto& x, const auto& y) ORBIS_INLINE_LAMBDA { detail::add_small(out, x, y); },
      [](const auto& x, const auto& y) ORBIS_INLINE_LAMBDA { return x + min(y, ~x); });
}
/// Saturating subtraction: a - b, clamped to zero.
template <detail::small_unsigned T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<T, N, Target> subtract_saturated(const vec<T, N, Target>& a,
                                                                       const vec<T, N, Target>& b) noexcept {
  return detail::binary(
      a, b, [](auto& out, const auto& x, const auto& y) ORBIS_INLINE_LAMBDA { detail::subtract_small(out, x, y); },
      [](const auto& x, const auto& y) ORBIS_INLINE_LAMBDA { return max(x, y) - y; });
}
/// Rounded average: (a + b + 1) / 2, rounded down, without overflow.
template <detail::small_unsigned T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<T, N, Target> average(const vec<T, N, Target>& a,
                                                            const vec<T, N, Target>& b) noexcept {
  return detail::binary(
      a, b, [](auto& out, const auto& x, const auto& y) ORBIS_INLINE_LAMBDA { detail::average_small(out, x, y); },
      [](const auto& x, const auto& y) ORBIS_INLINE_LAMBDA { return (x | y) - ((x ^ y) >> 1); });
}

/// Lane i is a[2 i] * b[2 i] + a[2 i + 1] * b[2 i + 1]. For vectors of at least 16 bytes.
template <std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<std::int32_t, N / 2, Target> multiply_add_pairs(
    const vec<std::int16_t, N, Target>& a, const vec<std::int16_t, N, Target>& b) noexcept {
  using out = vec<std::int32_t, N / 2, Target>;
  if constexpr (!vec<std::int16_t, N, Target>::is_native) {
    return {multiply_add_pairs(a.v.low, b.v.low), multiply_add_pairs(a.v.high, b.v.high)};
#if ORBIS_X86
  } else if constexpr (sizeof(a.v) >= 16) {
    out r;
    detail::add_products(r.v, a.v, b.v);
    return r;
#endif
  } else {
    const auto x = bits_as<std::int32_t>(a), y = bits_as<std::int32_t>(b);
    const out low = ((x << 16) >> 16) * ((y << 16) >> 16), high = (x >> 16) * (y >> 16);
    return low + high;
  }
}
/// Lane i is a[2 i] * b[2 i] + a[2 i + 1] * b[2 i + 1]. For vectors of at least 16 bytes. @pre the result fits into 16
/// bits
template <std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<std::int16_t, N / 2, Target> multiply_add_pairs(
    const vec<std::uint8_t, N, Target>& a, const vec<std::int8_t, N, Target>& b) noexcept {
  using out = vec<std::int16_t, N / 2, Target>;
  if constexpr (!vec<std::uint8_t, N, Target>::is_native) {
    return {multiply_add_pairs(a.v.low, b.v.low), multiply_add_pairs(a.v.high, b.v.high)};
#if ORBIS_X86
  } else if constexpr (sizeof(a.v) >= 16 && Target::needs >= level::popcnt) {
    out r;
    if constexpr (sizeof(a.v) == 64)
      detail::byte_products_64(r.v, a.v, b.v);
    else if constexpr (sizeof(a.v) == 32)
      detail::byte_products_32(r.v, a.v, b.v);
    else
      detail::byte_products_16(r.v, a.v, b.v);
    return r;
#endif
  } else {
    const auto x = bits_as<std::int16_t>(a), y = bits_as<std::int16_t>(b);
    const out low = (x & 255) * ((y << 8) >> 8),
              high = bits_as<std::int16_t>(bits_as<std::uint16_t>(x) >> 8) * (y >> 8);
    return low + high;
  }
}

/// Packs each block of 16 bytes: the eight lanes of a, then those of b, each clamped to a byte in [0, 255]. One
/// instruction. Inverse of zip_low_in_blocks and zip_high_in_blocks. For vectors of at least 16 bytes.
template <std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<std::uint8_t, 2 * N, Target> narrow_in_blocks(
    const vec<std::int16_t, N, Target>& a, const vec<std::int16_t, N, Target>& b) noexcept {
  using words = vec<std::int16_t, N, Target>;
  using out = vec<std::uint8_t, 2 * N, Target>;
  if constexpr (!words::is_native) {
    return {narrow_in_blocks(a.v.low, b.v.low), narrow_in_blocks(a.v.high, b.v.high)};
  } else {
    out r;
#if ORBIS_X86
    detail::pack_words(r.v, a.v, b.v);
#else
    static_assert(N == 8);
    const auto bytes = [](const words& w)
                           ORBIS_INLINE_LAMBDA { return convert<std::uint8_t>(min(max(w, words(0)), words(255))); };
    r = out(bytes(a), bytes(b));
#endif
    return r;
  }
}

/// Number of set bits in each lane (W. Mula, N. Kurz, D. Lemire, "Faster population counts using AVX2 instructions",
/// The Computer Journal 2018). A few instructions per register.
template <std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<std::uint64_t, N, Target> count_bits(
    const vec<std::uint64_t, N, Target>& a) noexcept {
  using V = vec<std::uint64_t, N, Target>;
  if constexpr (!V::is_native) {
    return {count_bits(a.v.low), count_bits(a.v.high)};
#if ORBIS_X86
  } else if constexpr (sizeof(a.v) == 64) {
    V out;
    detail::count_bits_64(out.v, a.v);
    return out;
  } else if constexpr (sizeof(a.v) == 32) {
    V out;
    detail::count_bits_32(out.v, a.v);
    return out;
#endif
  } else {
    return V::generate([&](std::size_t i) ORBIS_INLINE_LAMBDA { return std::uint64_t{ones<Target>(a.v[i])}; });
  }
}

}  // namespace orbis::simd

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Permutations of lanes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

#include <orbis/core/simd/memory.hpp>
#include <orbis/core/simd/vec.hpp>

namespace orbis::simd {

namespace detail {

/// Lane i is lane Place(i) of the concatenation of a and b. For vectors of one register.
template <auto Place, class V>
[[nodiscard]] ORBIS_ALWAYS_INLINE V shuffle_by(const V& a, const V& b) noexcept {
  V out;
  [&]<std::size_t... I>(std::index_sequence<I...>) ORBIS_INLINE_LAMBDA {
    choose(out.v, a.v, b.v, std::index_sequence<Place(I)...>{});
  }
  (std::make_index_sequence<V::count>{});
  return out;
}
/// The first halves of a and b (Half = 0) or the second ones (1), interleaved.
template <std::size_t Half, class V>
[[nodiscard]] ORBIS_ALWAYS_INLINE V zip(const V& a, const V& b) noexcept {
  if constexpr (V::is_native) {
    constexpr auto place = [](std::size_t i) { return (Half * V::count + i) / 2 + (i % 2) * V::count; };
    return shuffle_by<place>(a, b);
  } else if constexpr (Half == 0) {
    return {zip<0>(a.v.low, b.v.low), zip<1>(a.v.low, b.v.low)};
  } else {
    return {zip<0>(a.v.high, b.v.high), zip<1>(a.v.high, b.v.high)};
  }
}
/// The even lanes (Odd = 0) or odd lanes (1) of a, then those of b.
template <std::size_t Odd, class V>
[[nodiscard]] ORBIS_ALWAYS_INLINE V unzip(const V& a, const V& b) noexcept {
  if constexpr (V::is_native) {
    constexpr auto place = [](std::size_t i) { return 2 * i + Odd; };
    return shuffle_by<place>(a, b);
  } else {
    return {unzip<Odd>(a.v.low, a.v.high), unzip<Odd>(b.v.low, b.v.high)};
  }
}
/// Like zip, within each 16-byte block.
template <std::size_t Half, class V>
[[nodiscard]] ORBIS_ALWAYS_INLINE V zip_in_blocks(const V& a, const V& b) noexcept {
  if constexpr (V::is_native) {
    constexpr auto place = [](std::size_t i) {
      constexpr std::size_t block = 16 / sizeof(typename V::value_type);
      return i / block * block + (Half * block + i % block) / 2 + (i % 2) * V::count;
    };
    return shuffle_by<place>(a, b);
  } else {
    return {zip_in_blocks<Half>(a.v.low, b.v.low), zip_in_blocks<Half>(a.v.high, b.v.high)};
  }
}

#if ORBIS_X86
template <class V, class I>
ORBIS_TARGET_AVX2 inline void look_up_32(V& out, const V& table, const I& at) noexcept {
  out =
      reinterpret_cast<V>(_mm256_permutevar8x32_epi32(reinterpret_cast<__m256i>(table), reinterpret_cast<__m256i>(at)));
}
template <class V, class I>
ORBIS_TARGET_AVX512 inline void look_up_64(V& out, const V& table, const I& at) noexcept {
  out = reinterpret_cast<V>(
      _mm512_maskz_permutexvar_epi32(0xffff, reinterpret_cast<__m512i>(at), reinterpret_cast<__m512i>(table)));
}
template <class V, class I>
ORBIS_TARGET_AVX512 inline void look_up_two_64(V& out, const V& low, const V& high, const I& at) noexcept {
  out = reinterpret_cast<V>(_mm512_permutex2var_epi32(reinterpret_cast<__m512i>(low), reinterpret_cast<__m512i>(at),
                                                      reinterpret_cast<__m512i>(high)));
}
template <class V>
ORBIS_TARGET_POPCNT inline void look_up_bytes_16(V& out, const V& table, const V& at) noexcept {
  out = reinterpret_cast<V>(_mm_shuffle_epi8(reinterpret_cast<__m128i>(table), reinterpret_cast<__m128i>(at)));
}
template <class V>
ORBIS_TARGET_AVX2 inline void look_up_bytes_32(V& out, const V& table, const V& at) noexcept {
  out = reinterpret_cast<V>(_mm256_shuffle_epi8(reinterpret_cast<__m256i>(table), reinterpret_cast<__m256i>(at)));
}
template <class V>
ORBIS_TARGET_AVX512 inline void look_up_bytes_64(V& out, const V& table, const V& at) noexcept {
  out = reinterpret_cast<V>(_mm512_shuffle_epi8(reinterpret_cast<__m512i>(table), reinterpret_cast<__m512i>(at)));
}
#endif

}  // namespace detail

/// Lane i is lane I[i] of the concatenation of a and b. For vectors of one register; the result may have any number of
/// lanes.
template <std::size_t... I, class T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<T, sizeof...(I), Target> shuffle(const vec<T, N, Target>& a,
                                                                       const vec<T, N, Target>& b) noexcept {
  static_assert(vec<T, N, Target>::is_native && vec<T, sizeof...(I), Target>::is_native);
  vec<T, sizeof...(I), Target> out;
  detail::choose(out.v, a.v, b.v, std::index_sequence<I...>{});
  return out;
}
template <std::size_t... I, class T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<T, sizeof...(I), Target> shuffle(const vec<T, N, Target>& a) noexcept {
  return shuffle<I...>(a, a);
}

/// The first halves of a and b, interleaved: a0 b0 a1 b1 ... Two to three instructions on AVX2.
template <class T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<T, N, Target> zip_low(const vec<T, N, Target>& a,
                                                            const vec<T, N, Target>& b) noexcept {
  return detail::zip<0>(a, b);
}
/// The second halves of a and b, interleaved.
template <class T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<T, N, Target> zip_high(const vec<T, N, Target>& a,
                                                             const vec<T, N, Target>& b) noexcept {
  return detail::zip<1>(a, b);
}
/// The even lanes of a, then those of b. Inverse of zip.
template <class T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<T, N, Target> unzip_even(const vec<T, N, Target>& a,
                                                               const vec<T, N, Target>& b) noexcept {
  return detail::unzip<0>(a, b);
}
/// The odd lanes of a, then those of b.
template <class T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<T, N, Target> unzip_odd(const vec<T, N, Target>& a,
                                                              const vec<T, N, Target>& b) noexcept {
  return detail::unzip<1>(a, b);
}

// Operations within each 16-byte block: one instruction on every target. Use them if the order of 16-byte blocks does
// not matter, or if narrow_in_blocks restores it. a and b have at least 16 bytes.

/// The first eight bytes of each 16-byte block of a and b, interleaved.
template <class T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<T, N, Target> zip_low_in_blocks(const vec<T, N, Target>& a,
                                                                      const vec<T, N, Target>& b) noexcept {
  return detail::zip_in_blocks<0>(a, b);
}
/// The last eight bytes of each 16-byte block of a and b, interleaved.
template <class T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<T, N, Target> zip_high_in_blocks(const vec<T, N, Target>& a,
                                                                       const vec<T, N, Target>& b) noexcept {
  return detail::zip_in_blocks<1>(a, b);
}

/// Lane i is table[at[i]], for four-byte numbers. One instruction on AVX2 and AVX-512 for a table of one register;
/// otherwise through memory. @pre 0 <= at[i] < N
template <class T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<T, N, Target> look_up(const vec<T, N, Target>& table,
                                                            const vec<std::int32_t, N, Target>& at) noexcept {
  static_assert(sizeof(T) == 4);
  using V = vec<T, N, Target>;
#if ORBIS_X86
  if constexpr (N == 16 && V::is_native) {
    V out;
    detail::look_up_64(out.v, table.v, at.v);
    return out;
  } else if constexpr (N == 8 && V::is_native) {
    V out;
    detail::look_up_32(out.v, table.v, at.v);
    return out;
  } else
#endif
  {
    std::array<T, N> value;
    table.store(value.data());
    return gather(value.data(), at);
  }
}
/// Lane i is entry at[i] of the table that consists of `low` and `high`, for four-byte numbers. @pre 0 <= at[i] < 2 N
template <class T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<T, N, Target> look_up(const vec<T, N, Target>& low, const vec<T, N, Target>& high,
                                                            const vec<std::int32_t, N, Target>& at) noexcept {
  static_assert(sizeof(T) == 4);
  using V = vec<T, N, Target>;
#if ORBIS_X86
  if constexpr (N == 16 && V::is_native) {
    V out;
    detail::look_up_two_64(out.v, low.v, high.v, at.v);
    return out;
  } else if constexpr (N == 8 && V::is_native) {  // the instruction takes the indices modulo 8
    V a, b;
    detail::look_up_32(a.v, low.v, at.v);
    detail::look_up_32(b.v, high.v, at.v);
    return select(at < 8, a, b);
  } else
#endif
  {
    std::array<T, 2 * N> value;
    low.store(value.data());
    high.store(value.data() + N);
    return gather(value.data(), at);
  }
}

/// In each 16-byte block, byte i is byte at[i] % 16 of the same block of `table`, or 0 if at[i] >= 128. One instruction
/// with SSE4.2 and above; otherwise byte by byte.
template <std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<std::uint8_t, N, Target> look_up_in_blocks(
    const vec<std::uint8_t, N, Target>& table, const vec<std::uint8_t, N, Target>& at) noexcept {
  using V = vec<std::uint8_t, N, Target>;
  static_assert(N >= 16);
  if constexpr (!V::is_native) {
    return {look_up_in_blocks(table.v.low, at.v.low), look_up_in_blocks(table.v.high, at.v.high)};
#if ORBIS_X86
  } else if constexpr (N == 64) {
    V out;
    detail::look_up_bytes_64(out.v, table.v, at.v);
    return out;
  } else if constexpr (N == 32) {
    V out;
    detail::look_up_bytes_32(out.v, table.v, at.v);
    return out;
  } else if constexpr (N == 16 && Target::needs >= level::popcnt) {
    V out;
    detail::look_up_bytes_16(out.v, table.v, at.v);
    return out;
#endif
  } else {
    std::array<std::uint8_t, N> value, place;
    table.store(value.data());
    at.store(place.data());
    std::array<std::uint8_t, N> out;
    for (std::size_t i = 0; i != N; ++i) out[i] = place[i] < 128 ? value[i / 16 * 16 + place[i] % 16] : std::uint8_t{0};
    return V::load(out.data());
  }
}

}  // namespace orbis::simd

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Gather (lanes from scattered addresses) and compress (selected lanes stored contiguously).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <orbis/core/simd/vec.hpp>

namespace orbis::simd {

namespace detail {

#if ORBIS_X86
/// Entry m: the indices of the bits set in m, in order, one per byte.
inline constexpr std::array<std::uint64_t, 256> set_bits = [] {
  std::array<std::uint64_t, 256> all{};
  for (std::size_t m = 0; m != all.size(); ++m)
    for (unsigned bit = 0, n = 0; bit != 8; ++bit)
      if ((m >> bit & 1U) != 0) all[m] |= std::uint64_t{bit} << (8 * n++);
  return all;
}();

/// Compresses eight four-byte numbers or four eight-byte numbers.
template <class V>
ORBIS_TARGET_AVX2 inline void compress_32(V& out, const V& v, std::uint32_t bits) noexcept {
  if constexpr (sizeof(v[0]) == 8) bits = _pdep_u32(bits, 0x55U) * 3U;
  const __m256i order = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(static_cast<long long>(set_bits[bits])));
  out = reinterpret_cast<V>(_mm256_permutevar8x32_epi32(reinterpret_cast<__m256i>(v), order));
}
template <class V, class Word>
ORBIS_TARGET_AVX512 inline void compress_64(V& out, const V& v, const Word& m) noexcept {
  if constexpr (sizeof(v[0]) == 8)
    out = reinterpret_cast<V>(_mm512_maskz_compress_epi64(m, reinterpret_cast<__m512i>(v)));
  else
    out = reinterpret_cast<V>(_mm512_maskz_compress_epi32(m, reinterpret_cast<__m512i>(v)));
}
template <class V, class I, class M>
ORBIS_TARGET_AVX2 inline void gather_32(V& out, const element_of<V>* from, const I& at, const M& m,
                                        const V& otherwise) noexcept {
  using T = element_of<V>;
  if constexpr (std::is_same_v<T, double>)
    out = reinterpret_cast<V>(_mm256_mask_i32gather_pd(reinterpret_cast<__m256d>(otherwise), from,
                                                       reinterpret_cast<__m128i>(at), reinterpret_cast<__m256d>(m), 8));
  else if constexpr (std::is_same_v<T, float>)
    out = reinterpret_cast<V>(_mm256_mask_i32gather_ps(reinterpret_cast<__m256>(otherwise), from,
                                                       reinterpret_cast<__m256i>(at), reinterpret_cast<__m256>(m), 4));
  else if constexpr (sizeof(T) == 8)
    out = reinterpret_cast<V>(
        _mm256_mask_i32gather_epi64(reinterpret_cast<__m256i>(otherwise), reinterpret_cast<const long long*>(from),
                                    reinterpret_cast<__m128i>(at), reinterpret_cast<__m256i>(m), 8));
  else
    out = reinterpret_cast<V>(
        _mm256_mask_i32gather_epi32(reinterpret_cast<__m256i>(otherwise), reinterpret_cast<const int*>(from),
                                    reinterpret_cast<__m256i>(at), reinterpret_cast<__m256i>(m), 4));
}
template <class V, class I, class Word>
ORBIS_TARGET_AVX512 inline void gather_64(V& out, const element_of<V>* from, const I& at, const Word& m,
                                          const V& otherwise) noexcept {
  using T = element_of<V>;
  if constexpr (std::is_same_v<T, double>)
    out = reinterpret_cast<V>(
        _mm512_mask_i32gather_pd(reinterpret_cast<__m512d>(otherwise), m, reinterpret_cast<__m256i>(at), from, 8));
  else if constexpr (std::is_same_v<T, float>)
    out = reinterpret_cast<V>(
        _mm512_mask_i32gather_ps(reinterpret_cast<__m512>(otherwise), m, reinterpret_cast<__m512i>(at), from, 4));
  else if constexpr (sizeof(T) == 8)
    out = reinterpret_cast<V>(
        _mm512_mask_i32gather_epi64(reinterpret_cast<__m512i>(otherwise), m, reinterpret_cast<__m256i>(at), from, 8));
  else
    out = reinterpret_cast<V>(
        _mm512_mask_i32gather_epi32(reinterpret_cast<__m512i>(otherwise), m, reinterpret_cast<__m512i>(at), from, 4));
}
#endif

}  // namespace detail

/// Lane i is from[at[i]] where m is set, else lane i of `otherwise`; memory is read only for lanes that are set. Uses
/// gather instructions for four- and eight-byte numbers on AVX2 and AVX-512 (a few cycles per lane); otherwise lane by
/// lane.
template <class T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<T, N, Target> gather(const T* from, const vec<std::int32_t, N, Target>& at,
                                                           const typename vec<T, N, Target>::mask_type& m,
                                                           const vec<T, N, Target>& otherwise) noexcept {
  using V = vec<T, N, Target>;
  constexpr std::size_t bytes = N * sizeof(T);
  if constexpr (!V::is_native) {
    return {gather(from, at.low(), m.v.low, otherwise.v.low), gather(from, at.high(), m.v.high, otherwise.v.high)};
#if ORBIS_X86
  } else if constexpr (bytes == 64 && sizeof(T) >= 4) {
    V out;
    detail::gather_64(out.v, from, at.v, m.v, otherwise.v);
    return out;
  } else if constexpr (bytes == 32 && sizeof(T) >= 4) {
    V out;
    detail::gather_32(out.v, from, at.v, m.v, otherwise.v);
    return out;
#endif
  } else {
    std::array<std::int32_t, N> place;
    std::array<T, N> value;
    at.store(place.data());
    otherwise.store(value.data());
    const auto wanted = bits(m);
    for (std::size_t i = 0; i != N; ++i)
      if ((wanted >> i & 1U) != 0) value[i] = from[place[i]];
    return V::load(value.data());
  }
}
/// Lane i is from[at[i]].
template <class T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<T, N, Target> gather(const T* from,
                                                           const vec<std::int32_t, N, Target>& at) noexcept {
  using V = vec<T, N, Target>;
  if constexpr (ORBIS_X86 && sizeof(T) >= 4 && Target::bytes >= 32) {
    return gather(from, at, V::mask_type::first(N), V(0));
  } else {
    std::array<std::int32_t, N> place;
    std::array<T, N> value;
    at.store(place.data());
    for (std::size_t i = 0; i != N; ++i) value[i] = from[place[i]];
    return V::load(value.data());
  }
}

/// Writes the lanes that are set in m contiguously to `to` and returns their number. `to` must have room for N numbers;
/// those after the compressed ones are unspecified. One permutation per register for four- and eight-byte numbers on
/// AVX2 and AVX-512; otherwise lane by lane, without branches.
template <class T, std::size_t N, target Target>
ORBIS_ALWAYS_INLINE std::size_t compress_store(T* to, const vec<T, N, Target>& a,
                                               const typename vec<T, N, Target>::mask_type& m) noexcept {
  using V = vec<T, N, Target>;
  constexpr std::size_t bytes = N * sizeof(T);
  if constexpr (!V::is_native) {
    const std::size_t n = compress_store(to, a.v.low, m.v.low);
    return n + compress_store(to + n, a.v.high, m.v.high);
#if ORBIS_X86
  } else if constexpr (bytes == 64 && sizeof(T) >= 4) {
    V out;
    detail::compress_64(out.v, a.v, m.v);
    out.store(to);
    return popcount(m);
  } else if constexpr (bytes == 32 && sizeof(T) >= 4) {
    V out;
    detail::compress_32(out.v, a.v, bits(m));
    out.store(to);
    return popcount(m);
#endif
  } else {
    std::array<T, N> value;
    a.store(value.data());
    const auto wanted = bits(m);
    std::size_t n = 0;
    for (std::size_t i = 0; i != N; ++i) {
      to[n] = value[i];
      n += wanted >> i & 1U;
    }
    return n;
  }
}

}  // namespace orbis::simd

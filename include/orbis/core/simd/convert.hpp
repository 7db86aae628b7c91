// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Conversions between vectors of different number types.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include <orbis/core/simd/vec.hpp>

namespace orbis::simd {

namespace detail {

#if ORBIS_X86
/// Widening conversion with one instruction, where g++ 12 would emit several. V and U have the same number of lanes.
template <class U, class V>
ORBIS_ALWAYS_INLINE void widen_16(U& out, const V& v) noexcept {
  using T = element_of<V>;
  __m128i m = _mm_setzero_si128();
  std::memcpy(&m, &v, sizeof v);
  const __m128i zero = _mm_setzero_si128();
  const auto upper = [&](const __m128i& x, const __m128i& below) ORBIS_INLINE_LAMBDA {
    if constexpr (std::is_signed_v<T>) return below;
    static_cast<void>(x);
    return zero;
  };
  constexpr std::size_t from = sizeof(T), to = sizeof(element_of<U>);
  if constexpr (from == 1) m = _mm_unpacklo_epi8(m, upper(m, _mm_cmpgt_epi8(zero, m)));
  if constexpr (from <= 2 && to >= 4) m = _mm_unpacklo_epi16(m, upper(m, _mm_cmpgt_epi16(zero, m)));
  if constexpr (from <= 4 && to == 8) m = _mm_unpacklo_epi32(m, upper(m, _mm_cmpgt_epi32(zero, m)));
  out = reinterpret_cast<U>(m);
}
template <class U, class V>
ORBIS_TARGET_AVX2 inline void widen_32(U& out, const V& v) noexcept {
  using T = element_of<V>;
  using R = element_of<U>;
  if constexpr (std::is_same_v<T, float>) {
    out = reinterpret_cast<U>(_mm256_cvtps_pd(reinterpret_cast<__m128>(v)));
  } else if constexpr (std::is_same_v<R, double>) {
    out = reinterpret_cast<U>(_mm256_cvtepi32_pd(reinterpret_cast<__m128i>(v)));
  } else {
    __m128i m = _mm_setzero_si128();
    std::memcpy(&m, &v, sizeof v);
    constexpr bool has_sign = std::is_signed_v<T>;
    __m256i r;
    if constexpr (sizeof(T) == 1 && sizeof(R) == 2) r = has_sign ? _mm256_cvtepi8_epi16(m) : _mm256_cvtepu8_epi16(m);
    if constexpr (sizeof(T) == 1 && sizeof(R) == 4) r = has_sign ? _mm256_cvtepi8_epi32(m) : _mm256_cvtepu8_epi32(m);
    if constexpr (sizeof(T) == 1 && sizeof(R) == 8) r = has_sign ? _mm256_cvtepi8_epi64(m) : _mm256_cvtepu8_epi64(m);
    if constexpr (sizeof(T) == 2 && sizeof(R) == 4) r = has_sign ? _mm256_cvtepi16_epi32(m) : _mm256_cvtepu16_epi32(m);
    if constexpr (sizeof(T) == 2 && sizeof(R) == 8) r = has_sign ? _mm256_cvtepi16_epi64(m) : _mm256_cvtepu16_epi64(m);
    if constexpr (sizeof(T) == 4 && sizeof(R) == 8) r = has_sign ? _mm256_cvtepi32_epi64(m) : _mm256_cvtepu32_epi64(m);
    out = reinterpret_cast<U>(r);
  }
}
template <class U, class V>
ORBIS_TARGET_AVX512 inline void widen_64(U& out, const V& v) noexcept {
  using T = element_of<V>;
  using R = element_of<U>;
  if constexpr (std::is_same_v<T, float>) {
    out = reinterpret_cast<U>(_mm512_maskz_cvtps_pd(0xff, reinterpret_cast<__m256>(v)));
  } else if constexpr (std::is_same_v<R, double>) {
    out = reinterpret_cast<U>(_mm512_maskz_cvtepi32_pd(0xff, reinterpret_cast<__m256i>(v)));
  } else {
    constexpr bool s = std::is_signed_v<T>;
    __m512i r;
    if constexpr (sizeof(T) == 1 && sizeof(R) == 2) {
      const auto m = reinterpret_cast<__m256i>(v);
      r = s ? _mm512_maskz_cvtepi8_epi16(~__mmask32{}, m) : _mm512_maskz_cvtepu8_epi16(~__mmask32{}, m);
    } else if constexpr (sizeof(T) == 1 && sizeof(R) == 4) {
      const auto m = reinterpret_cast<__m128i>(v);
      r = s ? _mm512_maskz_cvtepi8_epi32(0xffff, m) : _mm512_maskz_cvtepu8_epi32(0xffff, m);
    } else if constexpr (sizeof(T) == 1) {
      __m128i m = _mm_setzero_si128();
      std::memcpy(&m, &v, sizeof v);
      r = s ? _mm512_maskz_cvtepi8_epi64(0xff, m) : _mm512_maskz_cvtepu8_epi64(0xff, m);
    } else if constexpr (sizeof(T) == 2 && sizeof(R) == 4) {
      const auto m = reinterpret_cast<__m256i>(v);
      r = s ? _mm512_maskz_cvtepi16_epi32(0xffff, m) : _mm512_maskz_cvtepu16_epi32(0xffff, m);
    } else if constexpr (sizeof(T) == 2) {
      const auto m = reinterpret_cast<__m128i>(v);
      r = s ? _mm512_maskz_cvtepi16_epi64(0xff, m) : _mm512_maskz_cvtepu16_epi64(0xff, m);
    } else {
      const auto m = reinterpret_cast<__m256i>(v);
      r = s ? _mm512_maskz_cvtepi32_epi64(0xff, m) : _mm512_maskz_cvtepu32_epi64(0xff, m);
    }
    out = reinterpret_cast<U>(r);
  }
}
#endif

/// True if `widen_` above supports the conversion.
template <class T, class U>
inline constexpr bool widens = ORBIS_X86 != 0 && sizeof(U) > sizeof(T) &&
                               ((std::is_integral_v<T> && std::is_integral_v<U>) ||
                                (std::is_same_v<U, double> && !std::is_same_v<T, std::uint32_t>));

}  // namespace detail

/// Converts each lane to U as static_cast does: integers modulo 2^bits, floating-point numbers towards zero. The result
/// is unspecified for values outside the range of an integer U.
template <class U, class T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<U, N, Target> convert(const vec<T, N, Target>& a) noexcept {
  using out = vec<U, N, Target>;
  if constexpr (std::is_same_v<T, U>) {
    return a;
  } else if constexpr (!out::is_native || !vec<T, N, Target>::is_native) {
    return out(convert<U>(a.low()), convert<U>(a.high()));
  } else if constexpr (std::is_integral_v<T> && std::is_floating_point_v<U> && sizeof(T) < 4) {
    return convert<U>(convert<std::int32_t>(a));
  } else if constexpr (std::is_integral_v<U> && std::is_floating_point_v<T> && sizeof(U) < 4) {
    return convert<U>(convert<std::int32_t>(a));
  } else if constexpr (std::is_integral_v<T> && std::is_integral_v<U> && sizeof(T) > 2 * sizeof(U)) {
    return convert<U>(convert<detail::signed_of_size<sizeof(T) / 2>>(a));  // g++ 12 would convert lane by lane
  } else {
    out r;
#if ORBIS_X86
    if constexpr (detail::widens<T, U> && sizeof(r.v) == 64)
      detail::widen_64(r.v, a.v);
    else if constexpr (detail::widens<T, U> && sizeof(r.v) == 32)
      detail::widen_32(r.v, a.v);
    else if constexpr (detail::widens<T, U> && std::is_integral_v<U> && sizeof(r.v) == 16)
      detail::widen_16(r.v, a.v);
    else
#endif
      r.v = __builtin_convertvector(a.v, typename out::native);
    return r;
  }
}

/// Converts a mask to a mask for vectors of `Size`-byte numbers.
template <std::size_t Size, std::size_t From, std::size_t N, class Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE mask<Size, N, Target> mask_as(const mask<From, N, Target>& m) noexcept {
  using out = mask<Size, N, Target>;
  if constexpr (Size == From) {
    return m;
  } else if constexpr (detail::masks_are_bits<Target::bytes>) {
    return out::from_bits(bits(m));
  } else if constexpr (!out::is_native && !mask<From, N, Target>::is_native) {
    return {{mask_as<Size>(m.v.low), mask_as<Size>(m.v.high)}};
  } else {
    using to = detail::signed_of_size<Size>;
    using from = vec<detail::signed_of_size<From>, N, Target>;
    from lanes = select(m, from(-1), from(0));
    const auto wide = convert<to>(lanes);
    return wide < vec<to, N, Target>(0);
  }
}

}  // namespace orbis::simd

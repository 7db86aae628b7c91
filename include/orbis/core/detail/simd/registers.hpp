// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Operations on a single register: the compiler's vector types, and the functions that they lack on x86.
///
/// The compilers' vector types provide arithmetic, shifts, comparisons, conversions and constant shuffles. This file
/// provides the rest, one function each. Every function that needs an instruction set carries its target attribute and
/// takes registers by reference. A kernel template, which has no attribute, can then call it; the call is inlined once
/// the template is inlined into a function that has the attribute.
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <orbis/core/simd/dispatch.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::simd::detail {

template <class T, std::size_t N>
struct register_of {
  typedef T type __attribute__((vector_size(N * sizeof(T))));  // NOLINT(modernize-use-using): using rejects it
};
/// `N` numbers in one register.
template <class T, std::size_t N>
using reg = typename register_of<T, N>::type;

template <std::size_t Size>
using signed_of_size = std::conditional_t<
    Size == 8, std::int64_t,
    std::conditional_t<Size == 4, std::int32_t, std::conditional_t<Size == 2, std::int16_t, std::int8_t>>>;
/// An unsigned integer with at least `N` bits.
template <std::size_t N>
using word_of_bits = std::conditional_t<
    (N > 32), std::uint64_t,
    std::conditional_t<(N > 16), std::uint32_t, std::conditional_t<(N > 8), std::uint16_t, std::uint8_t>>>;

template <class V>
using element_of = std::remove_cvref_t<decltype(std::declval<V>()[0])>;

/// Comparisons, numbered as in the 512-bit instructions.
enum class order { equal = 0, less = 1, less_equal = 2, unequal = 4 };

#if ORBIS_X86

// -- SSE2: 16 bytes ---------------------------------------------------------------------------------------------------

/// Sets each lane of `out` to `b` if `b` is larger (Max) or smaller (not Max) than `a`, else to `a`. Uses the
/// intrinsic, because g++ 12 compiles the expression to a comparison and a blend if one operand is a constant.
template <bool Max, class V>
ORBIS_ALWAYS_INLINE void extremum_16(V& out, const V& a, const V& b) noexcept {
  if constexpr (sizeof(a[0]) == 8)
    out = reinterpret_cast<V>(Max ? _mm_max_pd(reinterpret_cast<__m128d>(b), reinterpret_cast<__m128d>(a))
                                  : _mm_min_pd(reinterpret_cast<__m128d>(b), reinterpret_cast<__m128d>(a)));
  else
    out = reinterpret_cast<V>(Max ? _mm_max_ps(reinterpret_cast<__m128>(b), reinterpret_cast<__m128>(a))
                                  : _mm_min_ps(reinterpret_cast<__m128>(b), reinterpret_cast<__m128>(a)));
}

// -- AVX2: 32 bytes ---------------------------------------------------------------------------------------------------

/// Sign bits of the lanes.
template <class V>
ORBIS_TARGET_AVX2 inline void sign_bits_32(std::uint32_t& out, const V& v) noexcept {
  constexpr std::size_t size = sizeof(element_of<V>);
  const auto m = reinterpret_cast<__m256i>(v);
  if constexpr (size == 8) {
    out = static_cast<std::uint32_t>(_mm256_movemask_pd(_mm256_castsi256_pd(m)));
  } else if constexpr (size == 4) {
    out = static_cast<std::uint32_t>(_mm256_movemask_ps(_mm256_castsi256_ps(m)));
  } else if constexpr (size == 2) {
    const __m128i bytes = _mm_packs_epi16(_mm256_castsi256_si128(m), _mm256_extracti128_si256(m, 1));
    out = static_cast<std::uint32_t>(_mm_movemask_epi8(bytes));
  } else {
    out = static_cast<std::uint32_t>(_mm256_movemask_epi8(m));
  }
}
template <class V>
ORBIS_TARGET_AVX2 inline void any_bit_32(bool& out, const V& v) noexcept {
  const auto m = reinterpret_cast<__m256i>(v);
  out = _mm256_testz_si256(m, m) == 0;
}
template <class V>
ORBIS_TARGET_AVX2 inline void broadcast_32(V& out, const element_of<V>& x) noexcept {
  using T = element_of<V>;
  if constexpr (std::is_same_v<T, double>)
    out = reinterpret_cast<V>(_mm256_set1_pd(x));
  else if constexpr (std::is_same_v<T, float>)
    out = reinterpret_cast<V>(_mm256_set1_ps(x));
  else if constexpr (sizeof(T) == 8)
    out = reinterpret_cast<V>(_mm256_set1_epi64x(static_cast<std::int64_t>(x)));
  else if constexpr (sizeof(T) == 4)
    out = reinterpret_cast<V>(_mm256_set1_epi32(static_cast<std::int32_t>(x)));
  else if constexpr (sizeof(T) == 2)
    out = reinterpret_cast<V>(_mm256_set1_epi16(static_cast<std::int16_t>(x)));
  else
    out = reinterpret_cast<V>(_mm256_set1_epi8(static_cast<char>(x)));
}
template <bool Max, class V>
ORBIS_TARGET_AVX2 inline void extremum_32(V& out, const V& a, const V& b) noexcept {
  if constexpr (sizeof(a[0]) == 8)
    out = reinterpret_cast<V>(Max ? _mm256_max_pd(reinterpret_cast<__m256d>(b), reinterpret_cast<__m256d>(a))
                                  : _mm256_min_pd(reinterpret_cast<__m256d>(b), reinterpret_cast<__m256d>(a)));
  else
    out = reinterpret_cast<V>(Max ? _mm256_max_ps(reinterpret_cast<__m256>(b), reinterpret_cast<__m256>(a))
                                  : _mm256_min_ps(reinterpret_cast<__m256>(b), reinterpret_cast<__m256>(a)));
}
/// Loads the first n numbers of four or eight bytes at p and sets the other lanes to zero. @pre n <= lanes
template <class V>
ORBIS_TARGET_AVX2 inline void load_first_32(V& out, const element_of<V>* p, std::size_t n) noexcept {
  if constexpr (sizeof(out[0]) == 8) {
    const __m256i wanted =
        _mm256_cmpgt_epi64(_mm256_set1_epi64x(static_cast<long long>(n)), _mm256_setr_epi64x(0, 1, 2, 3));
    out = reinterpret_cast<V>(_mm256_maskload_epi64(reinterpret_cast<const long long*>(p), wanted));
  } else {
    const __m256i wanted =
        _mm256_cmpgt_epi32(_mm256_set1_epi32(static_cast<int>(n)), _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7));
    out = reinterpret_cast<V>(_mm256_maskload_epi32(reinterpret_cast<const int*>(p), wanted));
  }
}
template <class V>
ORBIS_TARGET_AVX2 inline void square_root_32(V& out, const V& v) noexcept {
  if constexpr (sizeof(v[0]) == 8)
    out = reinterpret_cast<V>(_mm256_sqrt_pd(reinterpret_cast<__m256d>(v)));
  else
    out = reinterpret_cast<V>(_mm256_sqrt_ps(reinterpret_cast<__m256>(v)));
}
template <class V>
ORBIS_TARGET_AVX2 inline void floor_32(V& out, const V& v) noexcept {
  if constexpr (sizeof(v[0]) == 8)
    out = reinterpret_cast<V>(_mm256_floor_pd(reinterpret_cast<__m256d>(v)));
  else
    out = reinterpret_cast<V>(_mm256_floor_ps(reinterpret_cast<__m256>(v)));
}
template <class V>
ORBIS_TARGET_AVX2 inline void fused_32(V& out, const V& a, const V& b, const V& c) noexcept {
  if constexpr (sizeof(a[0]) == 8)
    out = reinterpret_cast<V>(
        _mm256_fmadd_pd(reinterpret_cast<__m256d>(a), reinterpret_cast<__m256d>(b), reinterpret_cast<__m256d>(c)));
  else
    out = reinterpret_cast<V>(
        _mm256_fmadd_ps(reinterpret_cast<__m256>(a), reinterpret_cast<__m256>(b), reinterpret_cast<__m256>(c)));
}

// -- AVX-512: 64 bytes ------------------------------------------------------------------------------------------------
// g++ 12 generates element-wise code for a 512-bit comparison whose result is stored; masks are therefore a separate
// register type. Masked intrinsics replace the unmasked ones for which g++ emits warnings.

template <order O, class V, class Word>
ORBIS_TARGET_AVX512 inline void compare_64(Word& out, const V& a, const V& b) noexcept {
  using T = element_of<V>;
  if constexpr (std::is_floating_point_v<T>) {
    constexpr int predicate = O == order::equal ? 0 : O == order::less ? 17 : O == order::less_equal ? 18 : 4;  // quiet
    if constexpr (sizeof(T) == 8)
      out = _mm512_cmp_pd_mask(reinterpret_cast<__m512d>(a), reinterpret_cast<__m512d>(b), predicate);
    else
      out = _mm512_cmp_ps_mask(reinterpret_cast<__m512>(a), reinterpret_cast<__m512>(b), predicate);
  } else {
    const auto x = reinterpret_cast<__m512i>(a), y = reinterpret_cast<__m512i>(b);
    constexpr int predicate = static_cast<int>(O);
    if constexpr (std::is_signed_v<T>) {
      if constexpr (sizeof(T) == 8) out = _mm512_cmp_epi64_mask(x, y, predicate);
      if constexpr (sizeof(T) == 4) out = _mm512_cmp_epi32_mask(x, y, predicate);
      if constexpr (sizeof(T) == 2) out = _mm512_cmp_epi16_mask(x, y, predicate);
      if constexpr (sizeof(T) == 1) out = _mm512_cmp_epi8_mask(x, y, predicate);
    } else {
      if constexpr (sizeof(T) == 8) out = _mm512_cmp_epu64_mask(x, y, predicate);
      if constexpr (sizeof(T) == 4) out = _mm512_cmp_epu32_mask(x, y, predicate);
      if constexpr (sizeof(T) == 2) out = _mm512_cmp_epu16_mask(x, y, predicate);
      if constexpr (sizeof(T) == 1) out = _mm512_cmp_epu8_mask(x, y, predicate);
    }
  }
}
/// Selects `a` where `m` is set, else `b`.
template <class V, class Word>
ORBIS_TARGET_AVX512 inline void blend_64(V& out, const Word& m, const V& a, const V& b) noexcept {
  using T = element_of<V>;
  if constexpr (std::is_same_v<T, double>) {
    out = reinterpret_cast<V>(_mm512_mask_blend_pd(m, reinterpret_cast<__m512d>(b), reinterpret_cast<__m512d>(a)));
  } else if constexpr (std::is_same_v<T, float>) {
    out = reinterpret_cast<V>(_mm512_mask_blend_ps(m, reinterpret_cast<__m512>(b), reinterpret_cast<__m512>(a)));
  } else {
    const auto x = reinterpret_cast<__m512i>(a), y = reinterpret_cast<__m512i>(b);
    if constexpr (sizeof(T) == 8) out = reinterpret_cast<V>(_mm512_mask_blend_epi64(m, y, x));
    if constexpr (sizeof(T) == 4) out = reinterpret_cast<V>(_mm512_mask_blend_epi32(m, y, x));
    if constexpr (sizeof(T) == 2) out = reinterpret_cast<V>(_mm512_mask_blend_epi16(m, y, x));
    if constexpr (sizeof(T) == 1) out = reinterpret_cast<V>(_mm512_mask_blend_epi8(m, y, x));
  }
}
template <class V>
ORBIS_TARGET_AVX512 inline void broadcast_64(V& out, const element_of<V>& x) noexcept {
  using T = element_of<V>;
  if constexpr (std::is_same_v<T, double>)
    out = reinterpret_cast<V>(_mm512_set1_pd(x));
  else if constexpr (std::is_same_v<T, float>)
    out = reinterpret_cast<V>(_mm512_set1_ps(x));
  else if constexpr (sizeof(T) == 8)
    out = reinterpret_cast<V>(_mm512_set1_epi64(static_cast<std::int64_t>(x)));
  else if constexpr (sizeof(T) == 4)
    out = reinterpret_cast<V>(_mm512_set1_epi32(static_cast<std::int32_t>(x)));
  else if constexpr (sizeof(T) == 2)
    out = reinterpret_cast<V>(_mm512_set1_epi16(static_cast<std::int16_t>(x)));
  else
    out = reinterpret_cast<V>(_mm512_set1_epi8(static_cast<char>(x)));
}
template <bool Max, class V>
ORBIS_TARGET_AVX512 inline void extremum_64(V& out, const V& a, const V& b) noexcept {
  if constexpr (sizeof(a[0]) == 8)
    out = reinterpret_cast<V>(
        Max ? _mm512_maskz_max_pd(0xff, reinterpret_cast<__m512d>(b), reinterpret_cast<__m512d>(a))
            : _mm512_maskz_min_pd(0xff, reinterpret_cast<__m512d>(b), reinterpret_cast<__m512d>(a)));
  else
    out = reinterpret_cast<V>(
        Max ? _mm512_maskz_max_ps(0xffff, reinterpret_cast<__m512>(b), reinterpret_cast<__m512>(a))
            : _mm512_maskz_min_ps(0xffff, reinterpret_cast<__m512>(b), reinterpret_cast<__m512>(a)));
}
template <class V>
ORBIS_TARGET_AVX512 inline void load_first_64(V& out, const element_of<V>* p, std::size_t n) noexcept {
  const std::uint32_t wanted = (1U << n) - 1;
  if constexpr (sizeof(out[0]) == 8)
    out = reinterpret_cast<V>(_mm512_maskz_loadu_epi64(static_cast<__mmask8>(wanted), p));
  else
    out = reinterpret_cast<V>(_mm512_maskz_loadu_epi32(static_cast<__mmask16>(wanted), p));
}
template <class V>
ORBIS_TARGET_AVX512 inline void square_root_64(V& out, const V& v) noexcept {
  if constexpr (sizeof(v[0]) == 8)
    out = reinterpret_cast<V>(_mm512_maskz_sqrt_pd(0xff, reinterpret_cast<__m512d>(v)));
  else
    out = reinterpret_cast<V>(_mm512_maskz_sqrt_ps(0xffff, reinterpret_cast<__m512>(v)));
}
template <class V>
ORBIS_TARGET_AVX512 inline void floor_64(V& out, const V& v) noexcept {
  constexpr int down = _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC;
  if constexpr (sizeof(v[0]) == 8)
    out = reinterpret_cast<V>(_mm512_maskz_roundscale_pd(0xff, reinterpret_cast<__m512d>(v), down));
  else
    out = reinterpret_cast<V>(_mm512_maskz_roundscale_ps(0xffff, reinterpret_cast<__m512>(v), down));
}
template <class V>
ORBIS_TARGET_AVX512 inline void fused_64(V& out, const V& a, const V& b, const V& c) noexcept {
  if constexpr (sizeof(a[0]) == 8)
    out = reinterpret_cast<V>(
        _mm512_fmadd_pd(reinterpret_cast<__m512d>(a), reinterpret_cast<__m512d>(b), reinterpret_cast<__m512d>(c)));
  else
    out = reinterpret_cast<V>(
        _mm512_fmadd_ps(reinterpret_cast<__m512>(a), reinterpret_cast<__m512>(b), reinterpret_cast<__m512>(c)));
}
#endif

}  // namespace orbis::simd::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Functions on floating-point vectors, and sums over lanes.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <orbis/core/simd/vec.hpp>

namespace orbis::simd {

/// Absolute value; the smallest value of a signed integer type is returned unchanged.
template <class T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<T, N, Target> abs(const vec<T, N, Target>& a) noexcept {
  using V = vec<T, N, Target>;
  if constexpr (!V::is_native) {
    return {abs(a.v.low), abs(a.v.high)};
  } else if constexpr (std::is_floating_point_v<T>) {
    using integer = detail::signed_of_size<sizeof(T)>;
    return bits_as<T>(bits_as<integer>(a) & vec<integer, N, Target>(std::numeric_limits<integer>::max()));
  } else {
    return max(a, -a);
  }
}
/// Negation, including the sign of zero.
template <class T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<T, N, Target> operator-(const vec<T, N, Target>& a) noexcept {
  using V = vec<T, N, Target>;
  if constexpr (V::is_native)
    return V::from_register(reinterpret_cast<typename V::native>(-reinterpret_cast<typename V::modular>(a.v)));
  else
    return {-a.v.low, -a.v.high};
}

/// Correctly rounded square root. About 10 to 20 cycles per register.
template <class T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<T, N, Target> sqrt(const vec<T, N, Target>& a) noexcept {
  using V = vec<T, N, Target>;
  if constexpr (!V::is_native) {
    return {sqrt(a.v.low), sqrt(a.v.high)};
  } else {
    V out;
#if ORBIS_X86
    if constexpr (sizeof(a.v) == 64)
      detail::square_root_64(out.v, a.v);
    else if constexpr (sizeof(a.v) == 32)
      detail::square_root_32(out.v, a.v);
    else if constexpr (sizeof(a.v) == 16 && sizeof(T) == 8)
      out.v = reinterpret_cast<typename V::native>(_mm_sqrt_pd(reinterpret_cast<__m128d>(a.v)));
    else if constexpr (sizeof(a.v) == 16)
      out.v = reinterpret_cast<typename V::native>(_mm_sqrt_ps(reinterpret_cast<__m128>(a.v)));
    else
#endif
      for (std::size_t i = 0; i != N; ++i) out.v[i] = std::sqrt(a.v[i]);
    return out;
  }
}
/// Floor: the largest integer that does not exceed the value. Lane by lane on SSE2.
template <class T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<T, N, Target> floor(const vec<T, N, Target>& a) noexcept {
  using V = vec<T, N, Target>;
  if constexpr (!V::is_native) {
    return {floor(a.v.low), floor(a.v.high)};
  } else {
    V out;
#if ORBIS_X86
    if constexpr (sizeof(a.v) == 64)
      detail::floor_64(out.v, a.v);
    else if constexpr (sizeof(a.v) == 32)
      detail::floor_32(out.v, a.v);
    else
#endif
      for (std::size_t i = 0; i != N; ++i) out.v[i] = std::floor(a.v[i]);
    return out;
  }
}

/// a * b + c with one rounding on targets with a fused instruction (AVX2 and above) and with two elsewhere. Use it only
/// for bounds and initial guesses, since targets differ.
template <class T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<T, N, Target> approximate_multiply_add(const vec<T, N, Target>& a,
                                                                             const vec<T, N, Target>& b,
                                                                             const vec<T, N, Target>& c) noexcept {
  using V = vec<T, N, Target>;
  if constexpr (!V::is_native) {
    return {approximate_multiply_add(a.v.low, b.v.low, c.v.low),
            approximate_multiply_add(a.v.high, b.v.high, c.v.high)};
#if ORBIS_X86
  } else if constexpr (sizeof(a.v) == 64) {
    V out;
    detail::fused_64(out.v, a.v, b.v, c.v);
    return out;
  } else if constexpr (sizeof(a.v) == 32) {
    V out;
    detail::fused_32(out.v, a.v, b.v, c.v);
    return out;
#endif
  } else {
    return a * b + c;
  }
}

/// 1 / sqrt(x) to about two units in the last place, for lanes with x > 0 that are neither denormal nor infinite; other
/// lanes are unspecified. Four steps of Newton's method, each of which squares the error, from an initial guess that
/// halves and negates the exponent. Many times faster than a square root and a division; the same bits on every target.
template <std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<double, N, Target> reciprocal_root(const vec<double, N, Target>& x) noexcept {
  using V = vec<double, N, Target>;
  using integers = vec<std::int64_t, N, Target>;
  const V half = 0.5 * x;
  V y = bits_as<double>(integers(0x5fe6eb50c7b537a9) - (bits_as<std::int64_t>(x) >> 1));
  y = y * (1.5 - half * y * y);
  y = y * (1.5 - half * y * y);
  y = y * (1.5 - half * y * y);
  return y * (1.5 - half * y * y);
}
/// sqrt(x) to about two units in the last place, for the same x as `reciprocal_root`; also 0 for 0.
template <std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE vec<double, N, Target> square_root(const vec<double, N, Target>& x) noexcept {
  return select(x == 0.0, x, x * reciprocal_root(x));
}

/// Sum over the lanes: halves are added until one number is left, in the same order on every target.
template <class T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE T sum(const vec<T, N, Target>& a) noexcept {
  if constexpr (N == 2)
    return static_cast<T>(a[0] + a[1]);
  else
    return sum(a.low() + a.high());
}
/// Minimum over the lanes; the sign of a zero result, and the result for NaN, are unspecified.
template <class T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE T least(const vec<T, N, Target>& a) noexcept {
  if constexpr (N == 2)
    return a[1] < a[0] ? a[1] : a[0];
  else
    return least(min(a.low(), a.high()));
}
/// Maximum over the lanes; the sign of a zero result, and the result for NaN, are unspecified.
template <class T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE T greatest(const vec<T, N, Target>& a) noexcept {
  if constexpr (N == 2)
    return a[0] < a[1] ? a[1] : a[0];
  else
    return greatest(max(a.low(), a.high()));
}

}  // namespace orbis::simd

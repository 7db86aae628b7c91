// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// `vec<T, N, Target>`: a vector of N numbers with element-wise arithmetic.
///
/// A vector that does not fit into one register of the target is split into halves, so N may be any power of two.
/// Results are rounded according to IEEE 754, and a product is never fused with a sum: all targets give the same bits.
/// Integers wrap modulo 2^bits.
#pragma once

#include <cstddef>
#include <cstring>
#include <type_traits>
#include <utility>

#include <orbis/core/detail/simd/registers.hpp>
#include <orbis/core/simd/mask.hpp>

namespace orbis::simd {

namespace detail {

// Registers are passed by reference, because the calling convention of functions that return a register differs with
// AVX.

/// Prevents the fusion of a product with a sum on targets that could fuse; see rounded_product.
template <target Target, class V>
ORBIS_ALWAYS_INLINE void round_product([[maybe_unused]] V& product) noexcept {
#if defined(__FMA__)
  [[maybe_unused]] constexpr bool can_fuse = true;
#else
  [[maybe_unused]] constexpr bool can_fuse = Target::needs >= level::avx2;  // elsewhere the barrier costs a copy
#endif
#if !defined(__clang__) && defined(__x86_64__)
  if constexpr (can_fuse && std::is_floating_point_v<element_of<V>>) asm("" : "+v"(product));
#elif !defined(__clang__) && defined(__aarch64__)
  if constexpr (std::is_floating_point_v<element_of<V>>) asm("" : "+w"(product));
#endif
}

/// `x` in all lanes.
template <class V, class T>
ORBIS_ALWAYS_INLINE void broadcast(V& out, T x) noexcept {
#if ORBIS_X86
  // In a template without a target attribute, g++ 12 fills a wide register lane by lane, even from a constant.
  if constexpr (sizeof(V) == 64)
    broadcast_64(out, x);
  else if constexpr (sizeof(V) == 32)
    broadcast_32(out, x);
  else
#endif
      if constexpr (std::is_floating_point_v<T>)
    out = x - V{};  // not +: the sign of zero would prevent folding
  else
    out = V{} + x;
}

template <class T, bool = std::is_integral_v<T>>
struct modular_of {
  using type = T;
};
template <class T>
struct modular_of<T, true> {
  using type = std::make_unsigned_t<T>;
};

/// Selects lanes from two registers of the same type.
template <class To, class V, std::size_t... I>
ORBIS_ALWAYS_INLINE void choose(To& out, const V& a, const V& b, std::index_sequence<I...>) noexcept {
  out = __builtin_shufflevector(a, b, static_cast<int>(I)...);
}
template <std::size_t Offset, std::size_t... I>
[[nodiscard]] constexpr auto shifted(std::index_sequence<I...>) noexcept {
  return std::index_sequence<(I + Offset)...>{};
}

}  // namespace detail

/// A vector of N numbers of type T: floating-point numbers or fixed-size integers. A scalar converts to a vector with
/// that value in every lane. An operation costs one instruction per register unless its comment states otherwise.
template <class T, std::size_t N, target Target>
struct vec {
  static_assert(std::is_arithmetic_v<T> && N >= 2 && (N & (N - 1)) == 0, "the number of lanes must be a power of two");
  using value_type = T;
  using target_type = Target;
  using mask_type = simd::mask<sizeof(T), N, Target>;
  using mask = mask_type;
  using half = vec<T, N / 2, Target>;
  static constexpr std::size_t count = N;
  static constexpr bool is_native = N * sizeof(T) <= Target::bytes;  ///< fits into one register
  using native = detail::reg<T, is_native ? N : 2>;
  using storage = std::conditional_t<is_native, native, detail::halves<half>>;
  /// The register type for arithmetic: unsigned for signed integers, so that results wrap instead of overflowing.
  using modular = detail::reg<typename detail::modular_of<T>::type, is_native ? N : 2>;

  storage v;  ///< the register, or the halves

  vec() = default;
  ORBIS_ALWAYS_INLINE vec(T x) noexcept {  // NOLINT(google-explicit-constructor)
    if constexpr (is_native)
      detail::broadcast(v, x);
    else
      v.low = v.high = half(x);
  }
  ORBIS_ALWAYS_INLINE vec(const half& low, const half& high) noexcept {
    if constexpr (is_native)
      detail::choose(v, low.v, high.v, std::make_index_sequence<N>{});
    else
      v.low = low, v.high = high;
  }
  [[nodiscard]] static ORBIS_ALWAYS_INLINE vec from_register(const native& r) noexcept {
    vec out;
    out.v = r;
    return out;
  }

  /// Loads the numbers at p, which need not be aligned.
  [[nodiscard]] static ORBIS_ALWAYS_INLINE vec load(const T* p) noexcept {
    vec out;
    if constexpr (is_native)
      std::memcpy(&out.v, p, sizeof(native));
    else
      out.v.low = half::load(p), out.v.high = half::load(p + N / 2);
    return out;
  }
  /// Loads the first n <= N numbers at p and sets the other lanes to zero. Reads only n numbers. Copies through memory
  /// unless the numbers have four or eight bytes and fill one register of AVX2 or AVX-512.
  [[nodiscard]] static ORBIS_ALWAYS_INLINE vec load(const T* p, std::size_t n) noexcept {
#if ORBIS_X86
    if constexpr (is_native && sizeof(T) >= 4 && sizeof(native) >= 32) {
      vec out;
      if constexpr (sizeof(native) == 64)
        detail::load_first_64(out.v, p, n);
      else
        detail::load_first_32(out.v, p, n);
      return out;
    }
#endif
    alignas(N * sizeof(T)) T buffer[N] = {};
    std::memcpy(buffer, p, n * sizeof(T));
    return load(buffer);
  }
  ORBIS_ALWAYS_INLINE void store(T* p) const noexcept {
    if constexpr (is_native)
      std::memcpy(p, &v, sizeof(native));
    else
      v.low.store(p), v.high.store(p + N / 2);
  }
  /// Writes only the first n <= N lanes, through memory.
  ORBIS_ALWAYS_INLINE void store(T* p, std::size_t n) const noexcept {
    alignas(N * sizeof(T)) T buffer[N];
    store(buffer);
    std::memcpy(p, buffer, n * sizeof(T));
  }
  /// Lane i is f(i). Use it for constants: a constexpr f has no run-time cost.
  template <class F>
  [[nodiscard]] static ORBIS_ALWAYS_INLINE vec generate(const F& f, std::size_t first = 0) noexcept {
    vec out;
    if constexpr (is_native) [&]<std::size_t... I>(std::index_sequence<I...>) ORBIS_INLINE_LAMBDA {
        out.v = native{static_cast<T>(f(first + I))...};
      }
    (std::make_index_sequence<N>{});
    else out.v.low = half::generate(f, first), out.v.high = half::generate(f, first + N / 2);
    return out;
  }
  /// 0, 1, 2 ...
  [[nodiscard]] static ORBIS_ALWAYS_INLINE vec iota() noexcept {
    return generate([](std::size_t i) ORBIS_INLINE_LAMBDA { return static_cast<T>(i); });
  }
  /// Lane i; read through memory unless i is a constant.
  [[nodiscard]] ORBIS_ALWAYS_INLINE T operator[](std::size_t i) const noexcept {
    if constexpr (is_native)
      return v[i];
    else
      return i < N / 2 ? v.low[i] : v.high[i - N / 2];
  }
  [[nodiscard]] ORBIS_ALWAYS_INLINE half low() const noexcept {
    half out;
    if constexpr (is_native)
      detail::choose(out.v, v, v, std::make_index_sequence<N / 2>{});
    else
      out = v.low;
    return out;
  }
  [[nodiscard]] ORBIS_ALWAYS_INLINE half high() const noexcept {
    half out;
    if constexpr (is_native)
      detail::choose(out.v, v, v, detail::shifted<N / 2>(std::make_index_sequence<N / 2>{}));
    else
      out = v.high;
    return out;
  }

  friend ORBIS_ALWAYS_INLINE vec operator+(const vec& a, const vec& b) noexcept {
    if constexpr (is_native)
      return from_register(reinterpret_cast<native>(reinterpret_cast<modular>(a.v) + reinterpret_cast<modular>(b.v)));
    else
      return {a.v.low + b.v.low, a.v.high + b.v.high};
  }
  friend ORBIS_ALWAYS_INLINE vec operator-(const vec& a, const vec& b) noexcept {
    if constexpr (is_native)
      return from_register(reinterpret_cast<native>(reinterpret_cast<modular>(a.v) - reinterpret_cast<modular>(b.v)));
    else
      return {a.v.low - b.v.low, a.v.high - b.v.high};
  }
  friend ORBIS_ALWAYS_INLINE vec operator*(const vec& a, const vec& b) noexcept {
#if defined(__clang__)
#pragma clang fp contract(off)
#endif
    vec out;
    if constexpr (is_native) {
      out.v = reinterpret_cast<native>(reinterpret_cast<modular>(a.v) * reinterpret_cast<modular>(b.v));
      detail::round_product<Target>(out.v);
    } else {
      out.v.low = a.v.low * b.v.low, out.v.high = a.v.high * b.v.high;
    }
    return out;
  }
  /// For floating-point numbers only.
  friend ORBIS_ALWAYS_INLINE vec operator/(const vec& a, const vec& b) noexcept {
    static_assert(std::is_floating_point_v<T>);
    if constexpr (is_native)
      return from_register(a.v / b.v);
    else
      return {a.v.low / b.v.low, a.v.high / b.v.high};
  }
  ORBIS_ALWAYS_INLINE vec& operator+=(const vec& b) noexcept { return *this = *this + b; }
  ORBIS_ALWAYS_INLINE vec& operator-=(const vec& b) noexcept { return *this = *this - b; }
  ORBIS_ALWAYS_INLINE vec& operator*=(const vec& b) noexcept { return *this = *this * b; }

  friend ORBIS_ALWAYS_INLINE mask_type operator==(const vec& a, const vec& b) noexcept {
    return compare<detail::order::equal>(a, b);
  }
  friend ORBIS_ALWAYS_INLINE mask_type operator!=(const vec& a, const vec& b) noexcept {
    return compare<detail::order::unequal>(a, b);
  }
  friend ORBIS_ALWAYS_INLINE mask_type operator<(const vec& a, const vec& b) noexcept {
    return compare<detail::order::less>(a, b);
  }
  friend ORBIS_ALWAYS_INLINE mask_type operator<=(const vec& a, const vec& b) noexcept {
    return compare<detail::order::less_equal>(a, b);
  }
  friend ORBIS_ALWAYS_INLINE mask_type operator>(const vec& a, const vec& b) noexcept {
    return compare<detail::order::less>(b, a);
  }
  friend ORBIS_ALWAYS_INLINE mask_type operator>=(const vec& a, const vec& b) noexcept {
    return compare<detail::order::less_equal>(b, a);
  }

  /// a where m is set, b elsewhere.
  friend ORBIS_ALWAYS_INLINE vec select(const mask_type& m, const vec& a, const vec& b) noexcept {
    if constexpr (!is_native) {
      return {select(m.v.low, a.v.low, b.v.low), select(m.v.high, a.v.high, b.v.high)};
#if ORBIS_X86
    } else if constexpr (mask_type::is_bits) {
      vec out;
      detail::blend_64(out.v, m.v, a.v, b.v);
      return out;
#endif
    } else {
      return from_register(m.v ? a.v : b.v);
    }
  }
  /// Like std::min: b where b < a, else a (also if one of them is NaN).
  friend ORBIS_ALWAYS_INLINE vec min(const vec& a, const vec& b) noexcept {
    if constexpr (is_native)
      return extremum<false>(a, b);
    else
      return {min(a.v.low, b.v.low), min(a.v.high, b.v.high)};
  }
  /// Like std::max: b where a < b, else a (also if one of them is NaN).
  friend ORBIS_ALWAYS_INLINE vec max(const vec& a, const vec& b) noexcept {
    if constexpr (is_native)
      return extremum<true>(a, b);
    else
      return {max(a.v.low, b.v.low), max(a.v.high, b.v.high)};
  }

  // Bit operations on integers.
  friend ORBIS_ALWAYS_INLINE vec operator&(const vec& a, const vec& b) noexcept {
    if constexpr (is_native)
      return from_register(a.v & b.v);
    else
      return {a.v.low & b.v.low, a.v.high & b.v.high};
  }
  friend ORBIS_ALWAYS_INLINE vec operator|(const vec& a, const vec& b) noexcept {
    if constexpr (is_native)
      return from_register(a.v | b.v);
    else
      return {a.v.low | b.v.low, a.v.high | b.v.high};
  }
  friend ORBIS_ALWAYS_INLINE vec operator^(const vec& a, const vec& b) noexcept {
    if constexpr (is_native)
      return from_register(a.v ^ b.v);
    else
      return {a.v.low ^ b.v.low, a.v.high ^ b.v.high};
  }
  friend ORBIS_ALWAYS_INLINE vec operator~(const vec& a) noexcept {
    if constexpr (is_native)
      return from_register(~a.v);
    else
      return {~a.v.low, ~a.v.high};
  }
  /// @pre 0 <= n < bits of T
  friend ORBIS_ALWAYS_INLINE vec operator<<(const vec& a, int n) noexcept {
    if constexpr (is_native)
      return from_register(reinterpret_cast<native>(reinterpret_cast<modular>(a.v)
                                                    << static_cast<typename detail::modular_of<T>::type>(n)));
    else
      return {a.v.low << n, a.v.high << n};
  }
  /// Arithmetic shift for signed numbers. @pre 0 <= n < bits of T
  friend ORBIS_ALWAYS_INLINE vec operator>>(const vec& a, int n) noexcept {
    if constexpr (is_native)
      return from_register(a.v >> static_cast<T>(n));
    else
      return {a.v.low >> n, a.v.high >> n};
  }
  /// Shifts lane by lane, for four- and eight-byte numbers only: there are no instructions for smaller ones.
  friend ORBIS_ALWAYS_INLINE vec operator<<(const vec& a, const vec& n) noexcept {
    static_assert(sizeof(T) >= 4);
    if constexpr (is_native)
      return from_register(reinterpret_cast<native>(reinterpret_cast<modular>(a.v) << reinterpret_cast<modular>(n.v)));
    else
      return {a.v.low << n.v.low, a.v.high << n.v.high};
  }
  friend ORBIS_ALWAYS_INLINE vec operator>>(const vec& a, const vec& n) noexcept {
    static_assert(sizeof(T) >= 4);
    if constexpr (is_native)
      return from_register(a.v >> n.v);
    else
      return {a.v.low >> n.v.low, a.v.high >> n.v.high};
  }

 private:
  template <bool Max>
  [[nodiscard]] static ORBIS_ALWAYS_INLINE vec extremum(const vec& a, const vec& b) noexcept {
    vec out;
#if ORBIS_X86
    if constexpr (std::is_floating_point_v<T> && sizeof(native) == 64)
      detail::extremum_64<Max>(out.v, a.v, b.v);
    else if constexpr (std::is_floating_point_v<T> && sizeof(native) == 32)
      detail::extremum_32<Max>(out.v, a.v, b.v);
    else if constexpr (std::is_floating_point_v<T> && sizeof(native) == 16)
      detail::extremum_16<Max>(out.v, a.v, b.v);
    else
#endif
      out.v = (Max ? a.v < b.v : b.v < a.v) ? b.v : a.v;
    return out;
  }
  template <detail::order O>
  [[nodiscard]] static ORBIS_ALWAYS_INLINE mask_type compare(const vec& a, const vec& b) noexcept {
    using detail::order;
    mask_type m;
    if constexpr (!is_native) {
      m.v.low = half::template compare<O>(a.v.low, b.v.low);
      m.v.high = half::template compare<O>(a.v.high, b.v.high);
#if ORBIS_X86
    } else if constexpr (mask_type::is_bits) {
      detail::compare_64<O>(m.v, a.v, b.v);
#endif
    } else if constexpr (O == order::equal) {
      m.v = a.v == b.v;
    } else if constexpr (O == order::unequal) {
      m.v = a.v != b.v;
    } else if constexpr (O == order::less) {
      m.v = a.v < b.v;
    } else {
      m.v = a.v <= b.v;
    }
    return m;
  }
  template <class, std::size_t, target>
  friend struct vec;
};

/// A vector that fills one register of the target.
template <class T, target Target>
using native_vec = vec<T, Target::bytes / sizeof(T), Target>;

template <class V>
inline constexpr bool is_vec = false;
template <class T, std::size_t N, target Target>
inline constexpr bool is_vec<vec<T, N, Target>> = true;
/// Any specialisation of `vec`.
template <class V>
concept vector = is_vec<V>;

/// Reinterprets the bits of the lanes as numbers of type U.
template <class U, class T, std::size_t N, target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE auto bits_as(const vec<T, N, Target>& a) noexcept {
  using out = vec<U, N * sizeof(T) / sizeof(U), Target>;
  if constexpr (out::is_native)
    return out::from_register(reinterpret_cast<typename out::native>(a.v));
  else
    return out(bits_as<U>(a.v.low), bits_as<U>(a.v.high));
}

}  // namespace orbis::simd

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Eight doubles that go through the same arithmetic, written once for every instruction set.
///
/// `lanes<Native>` holds them in registers of `Native` doubles: 8 for AVX-512, 4 for AVX2, 2 for what
/// the compiler assumes. Arithmetic on lanes is inlined into whoever calls it, so that a kernel is one
/// template, called from one small function for each instruction set:
///
/// @code
///   template <int Native> ORBIS_ALWAYS_INLINE void kernel(...);  // in terms of lanes<Native>
///   ORBIS_UNFUSED void kernel_portable(...) { kernel<2>(...); }
///   ORBIS_UNFUSED ORBIS_TARGET_AVX2 void kernel_avx2(...) { kernel<4>(...); }
///   ORBIS_UNFUSED ORBIS_TARGET_AVX512 void kernel_avx512(...) { kernel<8>(...); }
/// @endcode
///
/// Every lane is rounded as IEEE 754 says, products are never fused into sums and sums over lanes
/// have one order: all widths give the same bits.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include <orbis/core/simd.hpp>

namespace orbis::simd {

inline constexpr int lane_count = 8;

/// What comparing lanes gives; `N` of them.
template <int Native, int N = lane_count>
struct lane_mask {
  lane_mask<Native, N / 2> low, high;

  friend ORBIS_ALWAYS_INLINE lane_mask operator&(const lane_mask& a, const lane_mask& b) {
    return {a.low & b.low, a.high & b.high};
  }
  friend ORBIS_ALWAYS_INLINE lane_mask operator|(const lane_mask& a, const lane_mask& b) {
    return {a.low | b.low, a.high | b.high};
  }
  friend ORBIS_ALWAYS_INLINE lane_mask operator!(const lane_mask& a) { return {!a.low, !a.high}; }
};

namespace detail {

/// A register of doubles, of integers, and what comparing doubles gives.
template <int N>
struct native_lanes;
template <>
struct native_lanes<2> {
  typedef double numbers __attribute__((vector_size(16)));
  typedef std::int64_t bits __attribute__((vector_size(16)));
  typedef bits mask;
};
template <>
struct native_lanes<4> {
  typedef double numbers __attribute__((vector_size(32)));
  typedef std::int64_t bits __attribute__((vector_size(32)));
  typedef bits mask;
};
template <>
struct native_lanes<8> {
  typedef double numbers __attribute__((vector_size(64)));
  typedef std::int64_t bits __attribute__((vector_size(64)));
#if ORBIS_X86 && !defined(__clang__)
  // Of a comparison of 512 bits inlined into a function for AVX-512, g++ 12 would make eight; so mask
  // registers are used by hand.
  typedef std::uint8_t mask;
#else
  typedef bits mask;
#endif
};

}  // namespace detail

template <int N>
struct lane_mask<N, N> {
  using native = typename detail::native_lanes<N>::mask;
  native v;

  friend ORBIS_ALWAYS_INLINE lane_mask operator&(const lane_mask& a, const lane_mask& b) { return {native(a.v & b.v)}; }
  friend ORBIS_ALWAYS_INLINE lane_mask operator|(const lane_mask& a, const lane_mask& b) { return {native(a.v | b.v)}; }
  friend ORBIS_ALWAYS_INLINE lane_mask operator!(const lane_mask& a) { return {native(~a.v)}; }
};

/// `N` doubles. A number stands for itself in every lane.
template <int Native, int N = lane_count>
struct lanes {
  using mask = lane_mask<Native, N>;
  lanes<Native, N / 2> low, high;

  lanes() = default;
  ORBIS_ALWAYS_INLINE lanes(double x) : low(x), high(x) {}  // NOLINT(google-explicit-constructor)
  ORBIS_ALWAYS_INLINE lanes(const lanes<Native, N / 2>& a, const lanes<Native, N / 2>& b) : low(a), high(b) {}
  [[nodiscard]] static ORBIS_ALWAYS_INLINE lanes load(const double* p) {
    return {lanes<Native, N / 2>::load(p), lanes<Native, N / 2>::load(p + N / 2)};
  }
  ORBIS_ALWAYS_INLINE void store(double* p) const {
    low.store(p);
    high.store(p + N / 2);
  }

  friend ORBIS_ALWAYS_INLINE lanes operator+(const lanes& a, const lanes& b) {
    return {a.low + b.low, a.high + b.high};
  }
  friend ORBIS_ALWAYS_INLINE lanes operator-(const lanes& a, const lanes& b) {
    return {a.low - b.low, a.high - b.high};
  }
  friend ORBIS_ALWAYS_INLINE lanes operator*(const lanes& a, const lanes& b) {
    return {a.low * b.low, a.high * b.high};
  }
  friend ORBIS_ALWAYS_INLINE lanes operator/(const lanes& a, const lanes& b) {
    return {a.low / b.low, a.high / b.high};
  }
  friend ORBIS_ALWAYS_INLINE mask operator<(const lanes& a, const lanes& b) { return {a.low < b.low, a.high < b.high}; }
  friend ORBIS_ALWAYS_INLINE mask operator<=(const lanes& a, const lanes& b) {
    return {a.low <= b.low, a.high <= b.high};
  }
  friend ORBIS_ALWAYS_INLINE mask operator==(const lanes& a, const lanes& b) {
    return {a.low == b.low, a.high == b.high};
  }
  /// `a` where `m`, `b` elsewhere.
  friend ORBIS_ALWAYS_INLINE lanes select(const mask& m, const lanes& a, const lanes& b) {
    return {select(m.low, a.low, b.low), select(m.high, a.high, b.high)};
  }
  /// A few per cent off 1 / sqrt(x), for x > 0 that are neither denormal nor infinite.
  friend ORBIS_ALWAYS_INLINE lanes guess_reciprocal_root(const lanes& x) {
    return {guess_reciprocal_root(x.low), guess_reciprocal_root(x.high)};
  }
};

template <int N>
struct lanes<N, N> {
  using native = typename detail::native_lanes<N>::numbers;
  using mask = lane_mask<N, N>;
  native v;

  lanes() = default;
  ORBIS_ALWAYS_INLINE lanes(double x) {  // NOLINT(google-explicit-constructor)
#if ORBIS_X86 && !defined(__clang__)
    // g++ 12 forgets that all lanes are the same, and fills them one after the other.
    if constexpr (N >= 4)
      if (!__builtin_constant_p(x)) {
        asm("vbroadcastsd {%1, %0|%0, %1}" : "=v"(v) : "vm"(x));
        return;
      }
#endif
    v = x - native{};  // not +: that has a sign of zero to think of
  }
  [[nodiscard]] static ORBIS_ALWAYS_INLINE lanes load(const double* p) {
    lanes out;
    std::memcpy(&out.v, p, sizeof(native));
    return out;
  }
  ORBIS_ALWAYS_INLINE void store(double* p) const { std::memcpy(p, &v, sizeof(native)); }

  friend ORBIS_ALWAYS_INLINE lanes operator+(const lanes& a, const lanes& b) { return of(a.v + b.v); }
  friend ORBIS_ALWAYS_INLINE lanes operator-(const lanes& a, const lanes& b) { return of(a.v - b.v); }
  friend ORBIS_ALWAYS_INLINE lanes operator*(const lanes& a, const lanes& b) {
#if defined(__clang__)
#pragma clang fp contract(off)
#endif
    return of(a.v * b.v);
  }
  friend ORBIS_ALWAYS_INLINE lanes operator/(const lanes& a, const lanes& b) { return of(a.v / b.v); }
  friend ORBIS_ALWAYS_INLINE mask operator<(const lanes& a, const lanes& b) {
    if constexpr (in_registers)
      return compare<17>(a, b);
    else
      return {a.v < b.v};
  }
  friend ORBIS_ALWAYS_INLINE mask operator<=(const lanes& a, const lanes& b) {
    if constexpr (in_registers)
      return compare<18>(a, b);
    else
      return {a.v <= b.v};
  }
  friend ORBIS_ALWAYS_INLINE mask operator==(const lanes& a, const lanes& b) {
    if constexpr (in_registers)
      return compare<0>(a, b);
    else
      return {a.v == b.v};
  }
  friend ORBIS_ALWAYS_INLINE lanes select(const mask& m, const lanes& a, const lanes& b) {
    if constexpr (in_registers) {
      lanes out;
#if ORBIS_X86
      asm("vblendmpd {%1, %2, %0%{%3%}|%0%{%3%}, %2, %1}" : "=v"(out.v) : "v"(a.v), "v"(b.v), "Yk"(m.v));
#endif
      return out;
    } else {
      return of(m.v ? a.v : b.v);
    }
  }
  friend ORBIS_ALWAYS_INLINE lanes guess_reciprocal_root(const lanes& x) {
    // The exponent halved and negated, in the bits themselves.
    typename detail::native_lanes<N>::bits bits;
    std::memcpy(&bits, &x.v, sizeof bits);
    bits = 0x5fe6eb50c7b537a9 - (bits >> 1);
    lanes out;
    std::memcpy(&out.v, &bits, sizeof bits);
    return out;
  }

 private:
  static constexpr bool in_registers = std::is_integral_v<typename mask::native>;

  /// By a predicate as VCMPPD numbers them.
  template <int Predicate>
  [[nodiscard]] static ORBIS_ALWAYS_INLINE mask compare(const lanes& a, const lanes& b) {
    mask m;
#if ORBIS_X86
    asm("vcmppd {%3, %2, %1, %0|%0, %1, %2, %3}" : "=Yk"(m.v) : "v"(a.v), "v"(b.v), "i"(Predicate));
#endif
    return m;
  }
  [[nodiscard]] static ORBIS_ALWAYS_INLINE lanes of(const native& v) {
    lanes out;
    out.v = v;
    return out;
  }
};

/// A type of lanes.
template <class L>
inline constexpr bool is_lanes = false;
template <int Native>
inline constexpr bool is_lanes<lanes<Native>> = true;
template <class L>
concept lane_vector = is_lanes<L>;

/// 1 / sqrt(x) to about two units in the last place, for x > 0 that are neither denormal nor infinite;
/// other lanes are of no use. By Newton's method, whose error is squared in each step.
template <lane_vector L>
[[nodiscard]] ORBIS_ALWAYS_INLINE L reciprocal_root(const L& x) {
  const L half = 0.5 * x;
  L y = guess_reciprocal_root(x);
  y = y * (1.5 - half * y * y);
  y = y * (1.5 - half * y * y);
  y = y * (1.5 - half * y * y);
  return y * (1.5 - half * y * y);
}

/// sqrt(x) for the same x, and 0 for 0.
template <lane_vector L>
[[nodiscard]] ORBIS_ALWAYS_INLINE L square_root(const L& x) {
  return select(x == L(0.0), x, x * reciprocal_root(x));
}

/// The sum over the lanes, pairwise.
template <lane_vector L>
[[nodiscard]] ORBIS_ALWAYS_INLINE double sum(const L& x) {
  std::array<double, lane_count> v;
  x.store(v.data());
  return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]));
}

}  // namespace orbis::simd

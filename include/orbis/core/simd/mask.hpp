// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Masks: the lanes of a vector for which a comparison is true.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

#include <orbis/core/bits.hpp>
#include <orbis/core/detail/simd/registers.hpp>

namespace orbis::simd {

namespace detail {

/// The two halves of a mask or vector that does not fit into one register.
template <class Half>
struct halves {
  Half low, high;
};

/// True if masks are bits in a separate mask register, as for registers of 64 bytes on x86.
template <std::size_t Bytes>
inline constexpr bool masks_are_bits = ORBIS_X86 != 0 && Bytes == 64;

/// Sign bits of the lanes of one register.
template <class V>
[[nodiscard]] ORBIS_ALWAYS_INLINE std::uint32_t sign_bits(const V& v) noexcept {
  constexpr std::size_t size = sizeof(element_of<V>);
  std::uint32_t bits = 0;
#if ORBIS_X86
  if constexpr (sizeof(V) == 32) {
    sign_bits_32(bits, v);
  } else {
    __m128i m = _mm_setzero_si128();
    std::memcpy(&m, &v, sizeof v);
    if constexpr (size == 8) bits = static_cast<std::uint32_t>(_mm_movemask_pd(_mm_castsi128_pd(m)));
    if constexpr (size == 4) bits = static_cast<std::uint32_t>(_mm_movemask_ps(_mm_castsi128_ps(m)));
    if constexpr (size == 2)
      bits = static_cast<std::uint32_t>(_mm_movemask_epi8(_mm_packs_epi16(m, _mm_setzero_si128())));
    if constexpr (size == 1) bits = static_cast<std::uint32_t>(_mm_movemask_epi8(m));
  }
#else
  constexpr std::size_t n = sizeof(V) / size;
  if constexpr (size == 1 && n % 8 == 0 && std::endian::native == std::endian::little) {
    for (std::size_t i = 0; i != n / 8; ++i) {
      std::uint64_t word;
      std::memcpy(&word, reinterpret_cast<const char*>(&v) + 8 * i, 8);
      // The product moves bit 8 k to 56 + k; all other bits end up elsewhere.
      bits |= static_cast<std::uint32_t>((((word >> 7U) & 0x0101010101010101U) * 0x0102040810204080U) >> 56U)
              << (8 * i);
    }
  } else {
    for (std::size_t i = 0; i != n; ++i) bits |= (v[i] < 0 ? 1U : 0U) << i;
  }
#endif
  return bits;
}

}  // namespace detail

/// A set of `N` lanes of `Size` bytes. Comparisons return it; `select` and similar functions take it.
template <std::size_t Size, std::size_t N, class Target>
struct mask {
  static constexpr std::size_t count = N;
  static constexpr bool is_native = Size * N <= Target::bytes;
  static constexpr bool is_bits = is_native && detail::masks_are_bits<Size * N>;
  using half = mask<Size, N / 2, Target>;
  using word = detail::word_of_bits<N>;
  using lane = detail::signed_of_size<Size>;  ///< lane of a native mask that is not stored as bits: -1 if set, else 0
  using storage =
      std::conditional_t<!is_native, detail::halves<half>, std::conditional_t<is_bits, word, detail::reg<lane, N>>>;
  storage v;

  /// Lane i is set if bit i of `bits` is set.
  [[nodiscard]] static ORBIS_ALWAYS_INLINE mask from_bits(std::uint64_t bits) noexcept {
    mask out;
    if constexpr (!is_native) {
      out.v.low = half::from_bits(bits);
      out.v.high = half::from_bits(bits >> (N / 2));
    } else if constexpr (is_bits) {
      out.v = static_cast<word>(bits);
    } else if constexpr (8 * Size >= N) {
      [&]<std::size_t... I>(std::index_sequence<I...>) ORBIS_INLINE_LAMBDA {
        constexpr storage each{static_cast<lane>(std::uint64_t{1} << I)...};
        out.v = ((storage{} + static_cast<lane>(bits)) & each) == each;
      }
      (std::make_index_sequence<N>{});
    } else {  // bytes: eight of them share one byte of the word
      [&]<std::size_t... I>(std::index_sequence<I...>) ORBIS_INLINE_LAMBDA {
        constexpr storage each{static_cast<lane>(1U << (I % 8))...};
        const storage spread{static_cast<lane>(bits >> (I / 8 * 8))...};
        out.v = (spread & each) == each;
      }
      (std::make_index_sequence<N>{});
    }
    return out;
  }
  /// Sets the first `n` lanes; all if n >= N.
  [[nodiscard]] static ORBIS_ALWAYS_INLINE mask first(std::size_t n) noexcept {
    return from_bits(n >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << n) - 1);
  }

  friend ORBIS_ALWAYS_INLINE mask operator&(const mask& a, const mask& b) noexcept {
    if constexpr (is_native)
      return {static_cast<storage>(a.v & b.v)};
    else
      return {{a.v.low & b.v.low, a.v.high & b.v.high}};
  }
  friend ORBIS_ALWAYS_INLINE mask operator|(const mask& a, const mask& b) noexcept {
    if constexpr (is_native)
      return {static_cast<storage>(a.v | b.v)};
    else
      return {{a.v.low | b.v.low, a.v.high | b.v.high}};
  }
  friend ORBIS_ALWAYS_INLINE mask operator^(const mask& a, const mask& b) noexcept {
    if constexpr (is_native)
      return {static_cast<storage>(a.v ^ b.v)};
    else
      return {{a.v.low ^ b.v.low, a.v.high ^ b.v.high}};
  }
  friend ORBIS_ALWAYS_INLINE mask operator!(const mask& a) noexcept {
    if constexpr (!is_native)
      return {{!a.v.low, !a.v.high}};
    else
      return {static_cast<storage>(~a.v)};
  }
};

/// `a` and not `b`.
template <std::size_t Size, std::size_t N, class Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE mask<Size, N, Target> and_not(const mask<Size, N, Target>& a,
                                                                const mask<Size, N, Target>& b) noexcept {
  return a & !b;
}

/// Bit i is set if lane i is set; the remaining high bits are zero.
template <std::size_t Size, std::size_t N, class Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE std::conditional_t<(N > 32), std::uint64_t, std::uint32_t> bits(
    const mask<Size, N, Target>& m) noexcept {
  using word = std::conditional_t<(N > 32), std::uint64_t, std::uint32_t>;
  if constexpr (!mask<Size, N, Target>::is_native)
    return static_cast<word>(word{bits(m.v.low)} | word{bits(m.v.high)} << (N / 2));
  else if constexpr (mask<Size, N, Target>::is_bits)
    return m.v;
  else
    return detail::sign_bits(m.v);
}

template <std::size_t Size, std::size_t N, class Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE bool any(const mask<Size, N, Target>& m) noexcept {
  using M = mask<Size, N, Target>;
  if constexpr (!M::is_native) {
    return any(m.v.low | m.v.high);
#if ORBIS_X86
  } else if constexpr (!M::is_bits && Size * N == 32) {
    bool out;
    detail::any_bit_32(out, m.v);
    return out;
#endif
  } else {
    return bits(m) != 0;
  }
}
template <std::size_t Size, std::size_t N, class Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE bool none(const mask<Size, N, Target>& m) noexcept {
  return !any(m);
}
template <std::size_t Size, std::size_t N, class Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE bool all(const mask<Size, N, Target>& m) noexcept {
  using word = decltype(bits(m));
  return bits(m) == static_cast<word>(~word{0} >> (8 * sizeof(word) - N));
}

/// Number of set bits in a word, with POPCNT if the target has it.
template <target Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE std::uint32_t ones(std::uint64_t word) noexcept {
  if constexpr (Target::needs == level::portable)
    return count_ones(word);
  else
    return static_cast<std::uint32_t>(__builtin_popcountll(word));
}
/// Number of lanes that are set.
template <std::size_t Size, std::size_t N, class Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE std::uint32_t popcount(const mask<Size, N, Target>& m) noexcept {
  return ones<Target>(bits(m));
}

}  // namespace orbis::simd

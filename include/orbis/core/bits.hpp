// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bit counts, and bit strings such as binary descriptors: concept, word access, Hamming distance.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <ranges>
#include <type_traits>

namespace orbis {

/// Number of set bits in `x`, computed by adding neighbouring fields in parallel. Without the POPCNT instruction,
/// `std::popcount` would call a function of the compiler's library.
[[nodiscard]] constexpr std::uint32_t count_ones(std::uint64_t x) noexcept {
  x -= (x >> 1U) & 0x5555555555555555ULL;
  x = (x & 0x3333333333333333ULL) + ((x >> 2U) & 0x3333333333333333ULL);
  x = (x + (x >> 4U)) & 0x0f0f0f0f0f0f0f0fULL;
  return static_cast<std::uint32_t>((x * 0x0101010101010101ULL) >> 56U);
}

/// A bit string of any type: trivially copyable, without padding, and a whole number of 64-bit words long. Its bits are
/// the bits of its bytes in memory. `features::binary_descriptor<256>`, `std::array<std::uint64_t, 4>` and, on a
/// little-endian machine, a 32-byte row of an OpenCV descriptor matrix are the same string.
template <class D>
concept bit_string = std::is_trivially_copyable_v<D> && std::has_unique_object_representations_v<D> && sizeof(D) % 8 ==
                     0;

/// Number of bits of a bit string type.
template <bit_string D>
inline constexpr std::size_t bits_of = 8 * sizeof(D);

/// A contiguous range of bit strings.
template <class R>
concept bit_string_range =
    std::ranges::contiguous_range<R> && std::ranges::sized_range<R> && bit_string<std::ranges::range_value_t<R>>;

/// A contiguous range of strings of `Bits` bits.
template <class R, std::size_t Bits>
concept bit_string_range_of = bit_string_range<R> && bits_of<std::ranges::range_value_t<R>>
== Bits;

/// A string of `Bits` bits; bit `i` is bit `i % 64` of word `i / 64`.
template <std::size_t Bits>
requires(Bits > 0 && Bits % 64 == 0 && Bits < 65536) using bit_words = std::array<std::uint64_t, Bits / 64>;

/// The bits of a string as words.
template <bit_string D>
[[nodiscard]] constexpr bit_words<bits_of<D>> as_words(const D& string) noexcept {
  return std::bit_cast<bit_words<bits_of<D>>>(string);
}
template <bit_string D>
[[deprecated("use as_words")]] [[nodiscard]] constexpr bit_words<bits_of<D>> words_of(const D& string) noexcept {
  return as_words(string);
}

/// Hamming distance: the number of bits in which two strings differ.
template <std::size_t Words>
[[nodiscard]] constexpr std::uint32_t hamming_distance(const std::array<std::uint64_t, Words>& a,
                                                       const std::array<std::uint64_t, Words>& b) noexcept {
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i != Words; ++i) sum += count_ones(a[i] ^ b[i]);
  return sum;
}

}  // namespace orbis

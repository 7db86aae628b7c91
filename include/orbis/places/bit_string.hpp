// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the places ask of a descriptor: that it is a string of bits.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <ranges>
#include <type_traits>

#include <orbis/core/bits.hpp>

namespace orbis::places {

/// A binary descriptor of anybody's making: trivially copyable, without padding, of whole 64-bit words. Its bits
/// are those of its bytes in memory; `features::binary_descriptor`, `std::array<std::uint64_t, 4>` and, on a
/// little-endian machine, `std::array<unsigned char, 32>` over a row of OpenCV's mean the same.
template <class D>
concept bit_string = std::is_trivially_copyable_v<D> && std::has_unique_object_representations_v<D> && sizeof(D) % 8 ==
                     0;

/// Descriptors side by side in memory.
template <class R>
concept bit_string_range =
    std::ranges::contiguous_range<R> && std::ranges::sized_range<R> && bit_string<std::ranges::range_value_t<R>>;

/// Such a range, of descriptors of `Bits` bits.
template <class R, std::size_t Bits>
concept bit_string_range_of = bit_string_range<R> && 8 * sizeof(std::ranges::range_value_t<R>) == Bits;

/// `Bits` bits: bit `i` is bit `i % 64` of word `i / 64`.
template <std::size_t Bits>
requires(Bits > 0 && Bits % 64 == 0 && Bits < 65536) using bit_words = std::array<std::uint64_t, Bits / 64>;

/// A descriptor's bits.
template <bit_string D>
[[nodiscard]] constexpr bit_words<8 * sizeof(D)> words_of(const D& descriptor) noexcept {
  return std::bit_cast<bit_words<8 * sizeof(D)>>(descriptor);
}

/// The number of bits in which two strings differ.
template <std::size_t Words>
[[nodiscard]] constexpr std::uint32_t hamming_distance(const std::array<std::uint64_t, Words>& a,
                                                       const std::array<std::uint64_t, Words>& b) noexcept {
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i != Words; ++i) sum += count_ones(a[i] ^ b[i]);
  return sum;
}

}  // namespace orbis::places

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Sixteen bytes at a time on any machine, by the vectors that GCC and Clang have in their language: SSE2 on x86-64,
/// NEON on ARM. What kernels are made of where there is nothing better.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

namespace orbis::features::detail {

using bytes16 [[gnu::vector_size(16)]] = std::uint8_t;
using bytes8 [[gnu::vector_size(8)]] = std::uint8_t;
using words8 [[gnu::vector_size(16)]] = std::uint16_t;
using ints4 [[gnu::vector_size(16)]] = std::int32_t;
using floats4 [[gnu::vector_size(16)]] = float;

/// A vector from memory, wherever it lies.
template <class Vector, class T>
[[nodiscard]] inline Vector loaded(const T* from) noexcept {
  Vector v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
template <class Vector, class T>
inline void store(T* to, const Vector& v) noexcept {
  std::memcpy(to, &v, sizeof v);
}
[[nodiscard]] inline bytes16 load16(const std::uint8_t* from) noexcept { return loaded<bytes16>(from); }
inline void store16(std::uint8_t* to, bytes16 v) noexcept { store(to, v); }

[[nodiscard]] inline bytes16 min16(bytes16 a, bytes16 b) noexcept { return a < b ? a : b; }
[[nodiscard]] inline bytes16 max16(bytes16 a, bytes16 b) noexcept { return a > b ? a : b; }
[[nodiscard]] inline bool any16(bytes16 v) noexcept {
  std::array<std::uint64_t, 2> words;
  std::memcpy(words.data(), &v, sizeof v);
  return (words[0] | words[1]) != 0;
}
/// Bit i: the lowest bit of byte i.
[[nodiscard]] inline std::uint32_t bits16(bytes16 v) noexcept {
  std::uint32_t bits = 0;
  if constexpr (std::endian::native == std::endian::little) {
    std::array<std::uint64_t, 2> words;
    std::memcpy(words.data(), &v, sizeof v);
    // A product that moves bit 8 i to 56 + i; all others go elsewhere.
    for (std::size_t i = 0; i != 2; ++i)
      bits |= static_cast<std::uint32_t>(((words[i] & 0x0101010101010101U) * 0x0102040810204080U) >> 56U) << (8 * i);
  } else {
    for (std::size_t i = 0; i != 16; ++i) bits |= static_cast<std::uint32_t>(v[i] & 1U) << i;
  }
  return bits;
}

/// Every other byte as words. Which half are the even ones depends on the machine; `joined` undoes it on each.
[[nodiscard]] inline words8 low_bytes(bytes16 v) noexcept { return std::bit_cast<words8>(v) & 255; }
[[nodiscard]] inline words8 high_bytes(bytes16 v) noexcept { return std::bit_cast<words8>(v) >> 8; }
/// @pre low < 256
[[nodiscard]] inline bytes16 joined(words8 low, words8 high) noexcept {
  return std::bit_cast<bytes16>(low | (high << 8));
}

/// The low bytes, in order.
inline void store8_narrowed(std::uint8_t* to, words8 v) noexcept { store(to, __builtin_convertvector(v, bytes8)); }

/// (256 h + l + 2^15) / 2^16, rounded down, in 16 bits. @pre h + l / 256 <= 65407
[[nodiscard]] inline words8 rounded_high(words8 h, words8 l) noexcept { return (h + (l >> 8) + 128) >> 8; }

/// Four times `rounded_product`.
[[nodiscard]] inline floats4 rounded_products(floats4 a, floats4 b) noexcept {
#if defined(__clang__)
#pragma clang fp contract(off)
  return a * b;
#else
  floats4 product = a * b;
#if defined(__x86_64__)
  asm("" : "+x"(product));
#elif defined(__aarch64__)
  asm("" : "+w"(product));
#else
  asm("" : "+m"(product));
#endif
  return product;
#endif
}

}  // namespace orbis::features::detail

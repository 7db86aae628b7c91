// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Sixteen bytes at a time on any machine, by the vectors that GCC and Clang have in their language: SSE2 on x86-64,
/// NEON on ARM. What kernels are made of where there is nothing better.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>

namespace orbis::features::detail {

using bytes16 [[gnu::vector_size(16)]] = std::uint8_t;
using bytes8 [[gnu::vector_size(8)]] = std::uint8_t;
using words8 [[gnu::vector_size(16)]] = std::uint16_t;

[[nodiscard]] inline bytes16 load16(const std::uint8_t* from) noexcept {
  bytes16 v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
inline void store16(std::uint8_t* to, bytes16 v) noexcept { std::memcpy(to, &v, sizeof v); }
[[nodiscard]] inline bytes16 min16(bytes16 a, bytes16 b) noexcept { return a < b ? a : b; }
[[nodiscard]] inline bytes16 max16(bytes16 a, bytes16 b) noexcept { return a > b ? a : b; }
[[nodiscard]] inline bool any16(bytes16 v) noexcept {
  std::array<std::uint64_t, 2> words;
  std::memcpy(words.data(), &v, sizeof v);
  return (words[0] | words[1]) != 0;
}

[[nodiscard]] inline words8 load8_words(const std::uint16_t* from) noexcept {
  words8 v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
[[nodiscard]] inline words8 load8_widened(const std::uint8_t* from) noexcept {
  bytes8 v;
  std::memcpy(&v, from, sizeof v);
  return __builtin_convertvector(v, words8);
}
inline void store8(std::uint16_t* to, words8 v) noexcept { std::memcpy(to, &v, sizeof v); }
/// The low bytes.
inline void store8_narrowed(std::uint8_t* to, words8 v) noexcept {
  const auto bytes = __builtin_convertvector(v, bytes8);
  std::memcpy(to, &bytes, sizeof bytes);
}

/// (256 h + l + 2^15) / 2^16, rounded down, in 16 bits. @pre h + l / 256 <= 65407
[[nodiscard]] inline words8 rounded_high(words8 h, words8 l) noexcept { return (h + (l >> 8) + 128) >> 8; }

}  // namespace orbis::features::detail

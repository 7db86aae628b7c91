// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Counts of bits, and numbers in binary files of either byte order.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>

namespace orbis {

/// The number of ones in `x`, by adding neighbouring fields in parallel: without the POPCNT instruction
/// `std::popcount` is a call into the compiler's library.
[[nodiscard]] constexpr std::uint32_t count_ones(std::uint64_t x) noexcept {
  x -= (x >> 1U) & 0x5555555555555555ULL;
  x = (x & 0x3333333333333333ULL) + ((x >> 2U) & 0x3333333333333333ULL);
  x = (x + (x >> 4U)) & 0x0f0f0f0f0f0f0f0fULL;
  return static_cast<std::uint32_t>((x * 0x0101010101010101ULL) >> 56U);
}

/// The `T` stored at `from` in the byte order `order`.
template <class T>
requires std::is_arithmetic_v<T>
[[nodiscard]] T load_number(const char* from, std::endian order = std::endian::little) noexcept {
  char bytes[sizeof(T)];
  std::memcpy(bytes, from, sizeof(T));
  if (order != std::endian::native) std::reverse(bytes, bytes + sizeof(T));
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

/// Appends `value` in little-endian order.
template <class T>
requires std::is_arithmetic_v<T>
void append_little_endian(std::string& to, T value) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  if constexpr (std::endian::native != std::endian::little) std::reverse(bytes, bytes + sizeof(T));
  to.append(bytes, sizeof(T));
}

}  // namespace orbis

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Counting bits.
#pragma once

#include <cstdint>

namespace orbis {

/// The number of ones in `x`, by adding neighbouring fields in parallel: without the POPCNT instruction
/// `std::popcount` is a call into the compiler's library.
[[nodiscard]] constexpr std::uint32_t count_ones(std::uint64_t x) noexcept {
  x -= (x >> 1U) & 0x5555555555555555ULL;
  x = (x & 0x3333333333333333ULL) + ((x >> 2U) & 0x3333333333333333ULL);
  x = (x + (x >> 4U)) & 0x0f0f0f0f0f0f0f0fULL;
  return static_cast<std::uint32_t>((x * 0x0101010101010101ULL) >> 56U);
}

}  // namespace orbis

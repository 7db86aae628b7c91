// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Arithmetic on bytes as 16-bit words: the even and the odd bytes of a vector.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/vec.hpp>

namespace orbis::features::detail {

/// Bytes 0, 2, 4 ... as words.
template <std::size_t N, class Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE auto even_bytes(const simd::vec<std::uint8_t, N, Target>& v) noexcept {
  const auto words = simd::bits_as<std::uint16_t>(v);
  if constexpr (std::endian::native == std::endian::little)
    return words & decltype(words)(255);
  else
    return words >> 8;
}
/// Bytes 1, 3, 5 ... as words.
template <std::size_t N, class Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE auto odd_bytes(const simd::vec<std::uint8_t, N, Target>& v) noexcept {
  const auto words = simd::bits_as<std::uint16_t>(v);
  if constexpr (std::endian::native == std::endian::little)
    return words >> 8;
  else
    return words & decltype(words)(255);
}
/// Inverse of `even_bytes` and `odd_bytes`: interleaves the bytes. @pre all words < 256
template <std::size_t N, class Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE auto interleaved(const simd::vec<std::uint16_t, N, Target>& even,
                                                   const simd::vec<std::uint16_t, N, Target>& odd) noexcept {
  if constexpr (std::endian::native == std::endian::little)
    return simd::bits_as<std::uint8_t>(even | (odd << 8));
  else
    return simd::bits_as<std::uint8_t>(odd | (even << 8));
}
/// (256 high + low + 2^15) / 2^16, rounded down, in 16 bits. @pre high + low / 256 <= 65407
template <std::size_t N, class Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE auto rounded_high_byte(const simd::vec<std::uint16_t, N, Target>& high,
                                                         const simd::vec<std::uint16_t, N, Target>& low) noexcept {
  return (high + (low >> 8) + simd::vec<std::uint16_t, N, Target>(128)) >> 8;
}

}  // namespace orbis::features::detail

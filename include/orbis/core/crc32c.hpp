// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A checksum, fast enough for files of many megabytes: CRC-32C, as iSCSI has it.
///
/// G. Castagnoli, S. Bräuer, M. Herrmann, "Optimization of cyclic redundancy-check codes with 24 and
/// 32 parity bits", IEEE Transactions on Communications 41, 1993.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include <orbis/core/simd.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis {

namespace detail {

using crc32c_tables = std::array<std::array<std::uint32_t, 256>, 8>;

/// `tables[k][b]`: what a byte `b` followed by `k` bytes of zero does to the remainder.
[[nodiscard]] constexpr crc32c_tables make_crc32c_tables() noexcept {
  crc32c_tables tables{};
  for (std::uint32_t i = 0; i != 256; ++i) {
    std::uint32_t c = i;
    for (int bit = 0; bit != 8; ++bit) c = (c >> 1U) ^ ((c & 1U) != 0 ? 0x82f63b78U : 0U);
    tables[0][i] = c;
  }
  for (std::size_t k = 1; k != tables.size(); ++k)
    for (std::size_t i = 0; i != 256; ++i) {
      const std::uint32_t c = tables[k - 1][i];
      tables[k][i] = (c >> 8U) ^ tables[0][c & 0xffU];
    }
  return tables;
}
inline constexpr crc32c_tables crc32c_table = make_crc32c_tables();

/// Eight bytes at a time by tables: M. Kounavis, F. Berry, "A systematic approach to building high performance,
/// software-based, CRC generators", ISCC 2005.
inline std::uint32_t crc32c_portable(const std::byte* at, std::size_t size, std::uint32_t c) noexcept {
  for (; size >= 8; size -= 8, at += 8) {
    std::uint32_t next = 0;
    for (std::size_t k = 0; k != 8; ++k) {
      const auto byte = static_cast<std::uint32_t>(at[k]) ^ (k < 4 ? (c >> (8U * k)) & 0xffU : 0U);
      next ^= crc32c_table[7 - k][byte];
    }
    c = next;
  }
  for (; size != 0; --size, ++at) c = crc32c_table[0][(c ^ static_cast<std::uint32_t>(*at)) & 0xffU] ^ (c >> 8U);
  return c;
}

#if ORBIS_X86
ORBIS_TARGET("sse4.2")
inline std::uint32_t crc32c_sse42(const std::byte* at, std::size_t size, std::uint32_t c) noexcept {
  std::uint64_t wide = c;
  for (; size >= 8; size -= 8, at += 8) {
    std::uint64_t word;
    std::memcpy(&word, at, sizeof word);
    wide = _mm_crc32_u64(wide, word);
  }
  c = static_cast<std::uint32_t>(wide);
  for (; size != 0; --size, ++at) c = _mm_crc32_u8(c, static_cast<unsigned char>(*at));
  return c;
}
#endif

}  // namespace detail

/// The checksum of `bytes`; of bytes that follow others whose checksum is `before`. Every `level` gives the same.
[[nodiscard]] inline std::uint32_t crc32c(std::span<const std::byte> bytes, std::uint32_t before = 0,
                                          simd::level level = simd::level::avx512) noexcept {
#if ORBIS_X86
  using kernel = std::uint32_t(const std::byte*, std::size_t, std::uint32_t) noexcept;
  return ~simd::select<kernel>(level, {.portable = detail::crc32c_portable, .popcnt = detail::crc32c_sse42})(
      bytes.data(), bytes.size(), ~before);
#else
  static_cast<void>(level);
  return ~detail::crc32c_portable(bytes.data(), bytes.size(), ~before);
#endif
}

}  // namespace orbis

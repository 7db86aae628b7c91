// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Byte-level tools for files: numbers in either byte order, a checksum, and a text encoding.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include <orbis/core/simd/level.hpp>

namespace orbis {

/// Reads the `T` that is stored at `from` in the byte order `order`.
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

namespace detail {

using crc32c_tables = std::array<std::array<std::uint32_t, 256>, 8>;

/// `tables[k][b]`: the CRC of a byte `b` followed by `k` zero bytes.
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

/// Processes eight bytes at a time with lookup tables. Source: M. Kounavis, F. Berry, "A systematic approach to
/// building high performance, software-based, CRC generators", ISCC 2005.
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
    wide = __builtin_ia32_crc32di(wide, word);
  }
  c = static_cast<std::uint32_t>(wide);
  for (; size != 0; --size, ++at) c = __builtin_ia32_crc32qi(c, static_cast<unsigned char>(*at));
  return c;
}
#endif

}  // namespace detail

/// The CRC-32C checksum of `bytes`, as in iSCSI; `before` is the checksum of the preceding bytes. Linear time; with
/// SSE4.2, eight bytes take one or two cycles.
///
/// Source: G. Castagnoli, S. Bräuer, M. Herrmann, "Optimization of cyclic redundancy-check codes with 24 and 32 parity
/// bits", IEEE Transactions on Communications 41, 1993.
[[nodiscard]] inline std::uint32_t crc32c(std::span<const std::byte> bytes, std::uint32_t before = 0) noexcept {
#if ORBIS_X86
  if (simd::best_level() >= simd::level::popcnt) return ~detail::crc32c_sse42(bytes.data(), bytes.size(), ~before);
#endif
  return ~detail::crc32c_portable(bytes.data(), bytes.size(), ~before);
}

namespace detail {

/// The character for a base-85 digit, counting from '#'; two characters that are special in literals are replaced.
[[nodiscard]] constexpr char base85_character(std::uint32_t digit) noexcept {
  const char c = static_cast<char>('#' + digit);
  return c == '\\' ? 'x' : c == '?' ? 'y' : c;
}
inline constexpr auto base85_digits = [] {
  std::array<std::uint8_t, 256> digits{};
  digits.fill(255);
  for (std::uint8_t d = 0; d != 85; ++d) digits[static_cast<unsigned char>(base85_character(d))] = d;
  return digits;
}();

}  // namespace detail

/// Appends the bytes that `text` encodes in base 85: five characters for four bytes, most significant digit first,
/// using only characters that are safe in a string literal. Returns false if `text` is not valid.
[[nodiscard]] inline bool append_base85(std::string& bytes, std::string_view text) {
  if (text.size() % 5 != 0) return false;
  std::size_t to = bytes.size();
  bytes.resize(to + text.size() / 5 * 4);
  for (std::size_t i = 0; i != text.size(); i += 5) {
    std::uint64_t value = 0;
    for (std::size_t k = 0; k != 5; ++k) {
      const std::uint8_t digit = detail::base85_digits[static_cast<unsigned char>(text[i + k])];
      if (digit == 255) return false;
      value = 85 * value + digit;
    }
    if (value > 0xffffffffU) return false;
    for (unsigned k = 0; k != 4; ++k) bytes[to++] = static_cast<char>((value >> (24 - 8 * k)) & 0xffU);
  }
  return true;
}

}  // namespace orbis

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bytes as text that can stand in a string literal: five characters for four bytes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace orbis {

namespace detail {

/// The 85 characters from '#' on, but for the two that mean something in a literal.
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

/// `bytes` as text, filled up with zeros to a multiple of four.
[[nodiscard]] inline std::string to_base85(std::string_view bytes) {
  std::string text;
  text.reserve(bytes.size() / 4 * 5 + 5);
  for (std::size_t i = 0; i < bytes.size(); i += 4) {
    std::uint32_t value = 0;
    for (std::size_t k = 0; k != 4; ++k)
      value = value << 8U | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    std::array<char, 5> group{};
    for (std::size_t k = 5; k-- != 0; value /= 85) group[k] = detail::base85_character(value % 85);
    text.append(group.data(), group.size());
  }
  return text;
}

/// Appends the bytes that `text` stands for; false, if it is no such text.
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

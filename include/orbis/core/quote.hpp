// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Quotes text from files and arguments for use in messages: shortened, and on one line.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <orbis/core/utf8.hpp>

namespace orbis {

/// The length in bytes of the UTF-8 character at the beginning of `text` if it controls a terminal or the text layout
/// (C0 and C1 controls, DEL, line and paragraph separators, changes of writing direction); otherwise 0.
[[nodiscard]] constexpr std::size_t control_bytes(std::string_view text) noexcept {
  const auto is = [&](std::size_t i, unsigned first, unsigned last) {
    return i < text.size() && static_cast<unsigned char>(text[i]) >= first &&
           static_cast<unsigned char>(text[i]) <= last;
  };
  if (is(0, 0x00, 0x1f) || is(0, 0x7f, 0x7f)) return 1;
  if (is(0, 0xc2, 0xc2) && is(1, 0x80, 0x9f)) return 2;                // U+0080 ... U+009F
  const bool is_control = (is(1, 0x80, 0x80) && is(2, 0xa8, 0xae)) ||  // U+2028 ... U+202E
                          (is(1, 0x81, 0x81) && is(2, 0xa6, 0xa9));    // U+2066 ... U+2069
  return is(0, 0xe2, 0xe2) && is_control ? 3 : 0;
}

namespace detail {

/// Returns true if the byte is a UTF-8 continuation byte.
[[nodiscard]] constexpr bool continues_character(char byte) noexcept {
  return (static_cast<unsigned char>(byte) & 0xc0U) == 0x80U;
}

}  // namespace detail

/// Shortens the text to its first `most` bytes, followed by "...", if it is longer. Does not cut UTF-8 characters; "?"
/// replaces control characters (`control_bytes`) and, if the text is not UTF-8, all non-ASCII bytes.
[[nodiscard]] inline std::string shortened(std::string_view text, std::size_t most = 200) {
  std::size_t end = text.size();
  if (end > most)
    for (end = most; end != 0 && detail::continues_character(text[end]);) --end;
  const std::string_view part = text.substr(0, end);
  const bool is_text = is_utf8(part);
  std::string out;
  for (std::size_t i = 0; i != part.size();) {
    const std::size_t control =
        !is_text && static_cast<unsigned char>(part[i]) > 0x7f ? 1 : control_bytes(part.substr(i));
    out += control == 0 ? part[i] : '?';
    i += control == 0 ? 1 : control;
  }
  return end == text.size() ? out : out + "...";
}

/// Like `shortened`, for a path: keeps its end, which is more informative than its beginning.
[[nodiscard]] inline std::string shortened_path(std::string_view path, std::size_t most = 200) {
  if (path.size() <= most) return shortened(path, most);
  std::size_t begin = path.size() - most;
  while (begin != path.size() && detail::continues_character(path[begin])) ++begin;
  return "..." + shortened(path.substr(begin), most);
}

/// Quotes a word or line of a file, or an argument; at most 60 bytes of it.
[[nodiscard]] inline std::string in_quotes(std::string_view text) {
  std::string quoted = "\"";  // GCC 12 warns of an overrun in "..." + std::string
  quoted += shortened(text, 60);
  quoted += '"';
  return quoted;
}

}  // namespace orbis

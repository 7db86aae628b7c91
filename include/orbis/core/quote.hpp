// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Text from files and arguments in messages: short, in one line.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <orbis/core/utf8.hpp>

namespace orbis {

/// The text with at most `most` bytes of it, and "..." in place of the rest. Does not cut UTF-8 characters; "?"
/// replaces control characters and, if the text is not UTF-8, all bytes that are not ASCII.
[[nodiscard]] inline std::string shortened(std::string_view text, std::size_t most = 200) {
  const auto is_inside = [&](std::size_t i) { return (static_cast<unsigned char>(text[i]) & 0xc0U) == 0x80U; };
  std::size_t end = text.size();
  if (end > most)
    for (end = most; end != 0 && is_inside(end);) --end;
  std::string out{text.substr(0, end)};
  const bool is_text = is_utf8(out);
  for (char& c : out)
    if (const auto byte = static_cast<unsigned char>(c); byte < 0x20 || byte == 0x7f || (byte > 0x7f && !is_text))
      c = '?';
  return end == text.size() ? out : out + "...";
}

/// The same of a path, whose end says more than its beginning.
[[nodiscard]] inline std::string shortened_path(std::string_view path, std::size_t most = 200) {
  if (path.size() <= most) return shortened(path, most);
  std::size_t begin = path.size() - most;
  while (begin != path.size() && (static_cast<unsigned char>(path[begin]) & 0xc0U) == 0x80U) ++begin;
  return "..." + shortened(path.substr(begin), most);
}

/// A word or line of a file, or an argument, in quotation marks: at most 60 bytes of it.
[[nodiscard]] inline std::string in_quotes(std::string_view text) { return "\"" + shortened(text, 60) + "\""; }

}  // namespace orbis

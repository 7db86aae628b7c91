// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Text parsing shared by the readers: lines, fields and numbers, independent of the locale.
#pragma once

#include <charconv>
#include <concepts>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

namespace orbis::io::detail {

/// Returns "path:line", for the `where` of an error.
template <class = void>
[[nodiscard]] std::string at_line(const std::filesystem::path& path, std::size_t line) {
  return path.string() + ":" + std::to_string(line);
}

[[nodiscard]] constexpr bool is_blank(char c) noexcept { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

/// Converts an ASCII letter to lower case; returns any other character unchanged.
[[nodiscard]] constexpr char lower_case(char c) noexcept {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

template <class = void>
[[nodiscard]] std::string lower_cased(std::string text) {
  for (char& c : text) c = lower_case(c);
  return text;
}

/// The text without leading and trailing whitespace (spaces, tabs, CR and LF).
[[nodiscard]] constexpr std::string_view trimmed(std::string_view text) noexcept {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

/// Removes the next field from the front of `text` and returns it; empty if there is none.
[[nodiscard]] constexpr std::string_view next_field(std::string_view& text) noexcept {
  text = trimmed(text);
  std::size_t end = 0;
  while (end != text.size() && !is_blank(text[end])) ++end;
  const std::string_view field = text.substr(0, end);
  text.remove_prefix(end);
  return field;
}

/// Removes the next line from the front of `text` and returns it without its line ending. @pre !text.empty()
[[nodiscard]] constexpr std::string_view next_line(std::string_view& text) noexcept {
  const std::size_t end = text.find('\n');
  std::string_view line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

/// Parses the whole `field` as a number. Returns false if it is not one. Accepts "nan" and "inf" for floating point.
template <class T>
requires std::integral<T> || std::floating_point<T>
[[nodiscard]] bool parse_number(std::string_view field, T& value) noexcept {
  if (field.size() > 1 && field.front() == '+' && field[1] != '-') field.remove_prefix(1);
  const auto [end, failure] = std::from_chars(field.data(), field.data() + field.size(), value);
  return failure == std::errc{} && end == field.data() + field.size();
}

/// Calls `visit(line, number)` with every trimmed line that is neither blank nor a comment (`#`), and its line number
/// (from 1), as long as `visit` returns true. Skips a byte order mark.
template <std::predicate<std::string_view, std::size_t> Visit>
void for_each_line(std::string_view text, Visit&& visit) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::string_view line = trimmed(next_line(text));
    if (line.empty() || line.front() == '#') continue;
    if (!visit(line, number)) return;
  }
}

}  // namespace orbis::io::detail

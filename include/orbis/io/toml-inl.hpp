// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of toml.hpp.
#pragma once

#include <algorithm>

#include <orbis/core/file.hpp>
#include <orbis/core/utf8.hpp>
#include <orbis/io/toml.hpp>

namespace orbis::io {

namespace detail {

/// Returns true if each line that begins like a table header contains a key, as toml++ 3.3 assumes.
template <class = void>
[[nodiscard]] bool has_keys_in_heads(std::string_view text) noexcept {
  const auto skip_blanks = [](std::string_view& line) {
    line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
  };
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  while (!text.empty()) {
    std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    skip_blanks(line);
    if (!line.starts_with('[')) continue;
    for (int brackets = 0; brackets != 2 && line.starts_with('['); ++brackets) {
      line.remove_prefix(1);
      skip_blanks(line);
    }
    if (line.empty()) return false;
    const char c = line.front();
    const bool begins_key = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                            std::string_view{"_-\"'"}.find(c) != std::string_view::npos;
    if (!begins_key) return false;
  }
  return true;
}

/// Returns false if `text`, which follows a date, begins with a "T" that no time follows, or with a blank that neither
/// a time nor the end of the value follows.
[[nodiscard]] constexpr bool may_follow_date(std::string_view text) noexcept {
  if (text.empty() || std::string_view{"Tt "}.find(text[0]) == std::string_view::npos) return true;
  const char next = text.size() > 1 ? text[1] : '\n';
  return (next >= '0' && next <= '9') ||
         (text[0] == ' ' && std::string_view{" \t\r\n#,]}"}.find(next) != std::string_view::npos);
}

/// The reason why toml++ 3.3 would mishandle the text; null if there is none. Outside strings and comments, TOML
/// requires ASCII, but toml++ treats some non-ASCII characters as blanks. Its behaviour is undefined for a date with
/// "T" and no time, a list closed by "}", and some non-ASCII characters in strings or after a quotation mark in a word.
template <class = void>
[[nodiscard]] const char* find_mishandled(std::string_view text) {
  static constexpr std::string_view date = "dddd-dd-dd";
  const auto is_date = [](std::string_view word) {
    return std::equal(word.begin(), word.end(), date.begin(), date.end(),
                      [](char c, char form) { return form == 'd' ? c >= '0' && c <= '9' : c == form; });
  };
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  std::string open;  // brackets
  for (std::size_t i = 0; i < text.size();) {
    const char c = text[i];
    if (c == '[' || c == '{') open += c;
    if (c == ']' || c == '}') {
      if (open.empty() || open.back() != (c == ']' ? '[' : '{')) return "mismatched brackets";
      open.pop_back();
    }
    if (static_cast<unsigned char>(c) >= 0x80) return "non-ASCII characters need quotes";
    if (is_date(text.substr(i, date.size())) && !may_follow_date(text.substr(i + date.size())))
      return "a date is followed by neither a time nor the end of the value";
    if (c == '#') {
      i = std::min(text.find_first_of("\n\v\f\r", i), text.size());
      continue;
    }
    if (c != '"' && c != '\'') {
      ++i;
      continue;
    }
    const char before = i == 0 ? '\n' : text[i - 1];
    const std::string_view line = text.substr(0, i).substr(text.substr(0, i).find_last_of('\n') + 1);
    if (std::string_view{" \t\r\n=[{,.\"'"}.find(before) == std::string_view::npos ||
        (before == '.' && line.find('=') != std::string_view::npos))
      return "a quotation mark within a word";
    const std::string_view three = c == '"' ? "\"\"\"" : "'''";
    const bool has_lines = text.substr(i).starts_with(three);
    for (i += has_lines ? 3 : 1; i < text.size(); ++i) {
      if (c == '"' && text[i] == '\\') {
        ++i;  // any escaped character
        const std::size_t next = std::min(text.find_first_not_of(" \t\r\n", i), text.size());
        if (next != text.size() && static_cast<unsigned char>(text[next]) >= 0x80)
          return "a backslash before a non-ASCII character";
      } else if (!has_lines && text[i] == '\n') {
        break;  // an error; toml++ stops here, too
      } else if (text[i] == c && (!has_lines || text.substr(i).starts_with(three))) {
        i += has_lines ? 3 : 1;
        for (int more = 0; has_lines && more != 2 && i < text.size() && text[i] == c; ++more)
          ++i;  // part of the string
        break;
      }
    }
  }
  return nullptr;
}

}  // namespace detail

ORBIS_LAZY_INLINE result<toml::table> parse_toml(std::string_view text, const std::filesystem::path& where) {
  const auto reject = [&](const char* why) { return fail(errc::malformed, where.string(), why); };
  if (text.size() > max_toml_bytes) return reject("is too large for a settings file");
  if (!is_utf8(text)) return reject("not TOML: not UTF-8");
  if (!detail::has_keys_in_heads(text)) return reject("not TOML: a table without a name");
  if (const char* const why = detail::find_mishandled(text))
    return fail(errc::malformed, where.string(), std::string{"not TOML: "} + why);
  try {
    return toml::parse(text, std::string_view{});
  } catch (const toml::parse_error& e) {
    return fail(errc::malformed, where.string() + ":" + std::to_string(e.source().begin.line),
                "not TOML: " + std::string{e.description()});
  }
}

ORBIS_LAZY_INLINE result<toml::table> read_toml(const std::filesystem::path& path) {
  const auto text = read_file(path, max_toml_bytes);
  if (!text) return fail(text.error());
  return parse_toml(*text, path);
}

}  // namespace orbis::io

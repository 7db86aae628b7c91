// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The subset of YAML used by camera files: keys with values, one level of nesting, lists of numbers in brackets.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <orbis/core/result.hpp>
#include <orbis/io/detail/text.hpp>

namespace orbis::io::detail {

/// The values in a file, accessed by name; a nested name is "outer.inner".
class plain_yaml {
 public:
  /// Maximum size of a file; camera files are far smaller.
  static constexpr std::size_t max_bytes = 65536;

  /// Parses a file. Errors: malformed, with the line number (not of this form, a repeated name, an unterminated list),
  /// or larger than `max_bytes`.
  [[nodiscard]] static result<plain_yaml> parse(std::string_view text, const std::filesystem::path& where) {
    if (text.size() > max_bytes) return fail(errc::malformed, where.string(), "is too large for a settings file");
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    plain_yaml all;
    all.where_ = where;
    std::string outer;  // the parent of indented names
    for (std::size_t number = 1; !text.empty(); ++number) {
      const std::string_view raw = without_comment(next_line(text));
      const std::string_view line = trimmed(raw);
      if (line.empty() || line == "---" || line == "..." || raw.front() == '%') continue;
      const auto reject = [&](const std::string& why) { return fail(errc::malformed, at_line(where, number), why); };
      const std::size_t colon = line.find(':');
      const bool indented = raw.front() == ' ' || raw.front() == '\t';
      const std::string_view name = trimmed(line.substr(0, std::min(colon, line.size())));
      if (colon == std::string_view::npos || !is_name(name) || (colon + 1 < line.size() && !is_blank(line[colon + 1])))
        return reject("is not \"name: value\"");
      if (indented && outer.empty()) return reject("is indented, but no name precedes it");
      std::string value{trimmed(line.substr(colon + 1))};
      const std::size_t begins = number;
      while (value.starts_with('[') && value.back() != ']') {
        const std::string_view more = text.empty() ? "" : trimmed(without_comment(next_line(text)));
        if (more.find(':') != std::string_view::npos || (more.empty() && text.empty()))
          return fail(errc::malformed, at_line(where, begins), "is an unterminated list");
        value += ' ';
        value += more;
        ++number;
      }
      if (!indented) outer = value.empty() ? std::string{name} : std::string{};
      if (value.empty()) continue;
      std::string full = indented ? outer + "." + std::string{name} : std::string{name};
      if (all.find(full) != nullptr) return reject("defines " + full + " a second time");
      all.entries_.push_back({std::move(full), std::move(value), begins});
    }
    return all;
  }

  /// The value as text, without quotes. Errors: malformed (missing).
  [[nodiscard]] result<std::string> text(std::string_view name) const {
    const entry* const e = find(name);
    if (e == nullptr) return missing(name);
    std::string_view value = e->value;
    if (value.size() >= 2 && value.front() == value.back() && (value.front() == '"' || value.front() == '\''))
      value = value.substr(1, value.size() - 2);
    return std::string{value};
  }
  /// The finite numbers in a list, or a single number. Errors: malformed (missing, or not numbers).
  [[nodiscard]] result<std::vector<double>> numbers(std::string_view name) const {
    const entry* const e = find(name);
    if (e == nullptr) return missing(name);
    std::string_view rest = e->value;
    if (rest.front() == '[') rest = rest.substr(1, rest.size() - 2);
    std::vector<double> all;
    while (!rest.empty()) {
      const std::size_t comma = std::min(rest.find(','), rest.size());
      double value = 0.0;
      if (!parse_number(trimmed(rest.substr(0, comma)), value) || !std::isfinite(value))
        return fail(errc::malformed, at_line(where_, e->line), e->name + " must be a list of finite numbers");
      all.push_back(value);
      rest.remove_prefix(std::min(comma + 1, rest.size()));
      if (trimmed(rest).empty()) break;
    }
    return all;
  }
  /// Like `numbers`, for a list of exactly `count` numbers.
  [[nodiscard]] result<std::vector<double>> numbers(std::string_view name, std::size_t count) const {
    auto all = numbers(name);
    if (all && all->size() != count)
      return fail(errc::malformed, at_line(where_, find(name)->line),
                  std::string{name} + " has " + std::to_string(all->size()) + " numbers, not " + std::to_string(count));
    return all;
  }
  [[nodiscard]] bool contains(std::string_view name) const { return find(name) != nullptr; }

 private:
  struct entry {
    std::string name, value;
    std::size_t line;
  };

  [[nodiscard]] static std::string_view without_comment(std::string_view line) noexcept {
    for (std::size_t i = 0; i != line.size(); ++i)
      if (line[i] == '#' && (i == 0 || is_blank(line[i - 1]))) return line.substr(0, i);
    return line;
  }
  [[nodiscard]] static bool is_name(std::string_view text) noexcept {
    return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
    });
  }
  [[nodiscard]] const entry* find(std::string_view name) const {
    const auto at = std::find_if(entries_.begin(), entries_.end(), [&](const entry& e) { return e.name == name; });
    return at == entries_.end() ? nullptr : &*at;
  }
  [[nodiscard]] tl::unexpected<error> missing(std::string_view name) const {
    return fail(errc::malformed, where_.string(), std::string{name} + " is missing");
  }

  std::filesystem::path where_;
  std::vector<entry> entries_;
};

}  // namespace orbis::io::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Identifies the columns of a trajectory in text form by the names in its header.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <orbis/io/detail/text.hpp>

namespace orbis::io::detail {

/// Removes the next field from the front of a line and returns it. Fields end at commas if the line contains one,
/// otherwise at semicolons if it contains one, otherwise at blanks. A separator at the end of the line does not start
/// another field.
template <class = void>
[[nodiscard]] std::string_view next_value(std::string_view& line, char separator) {
  if (separator == ' ') return next_field(line);
  const std::size_t end = std::min(line.find(separator), line.size());
  const std::string_view field = trimmed(line.substr(0, end));
  line.remove_prefix(std::min(end + 1, line.size()));
  return field;
}
template <class = void>
[[nodiscard]] char find_separator(std::string_view line) {
  return line.find(',') != line.npos ? ',' : line.find(';') != line.npos ? ';' : ' ';
}

/// Column indices of the time, the position and the four components of the quaternion, in the order of the file.
using pose_columns = std::array<std::size_t, 8>;
inline constexpr pose_columns usual_columns{0, 1, 2, 3, 4, 5, 6, 7};

/// The columns listed in a header line.
struct pose_header {
  std::optional<std::size_t> quaternion;  ///< first column of the quaternion; empty if the line does not list it
  bool w_first = false;                   ///< w, x, y, z; otherwise x, y, z, w
  bool nanoseconds = false;
  bool is_comment = false;
  pose_columns columns = usual_columns;
  std::string problem{};   ///< the reason why poses cannot be read from these columns
  std::size_t before = 0;  ///< number of words of a comment before the name of the time column
  std::size_t names = 0;   ///< number of words from the name of the time column to the end
};

/// The name of a column in lower case, without quotes, punctuation or units.
struct column_name {
  std::string text;
  bool nanoseconds = false;

  [[nodiscard]] char last() const { return text.empty() ? ' ' : text.back(); }
  [[nodiscard]] std::string_view prefix() const { return std::string_view{text}.substr(0, text.size() - 1); }
  [[nodiscard]] bool is_time() const {
    return text == "t" || text.find("time") != text.npos || text.find("stamp") != text.npos;
  }
  /// Returns true for names such as x, tx, p_RS_R_x and pose.position.x.
  [[nodiscard]] bool is_position() const {
    if (text.empty()) return false;
    std::string_view word = prefix();
    while (word.ends_with('.') || word.ends_with('_')) word.remove_suffix(1);
    if (word.starts_with("p_")) return true;
    word.remove_prefix(word.find_last_of("._") + 1);  // npos + 1 is 0
    constexpr std::string_view known[] = {"", "t", "p", "pos", "position", "trans", "translation"};
    return std::ranges::find(known, word) != std::end(known);
  }
};
/// The names of the columns in a line; empty if there are more than 200, because such a line is not a pose header and
/// the names would take many times the memory of the line.
template <class = void>
[[nodiscard]] std::vector<column_name> column_names(std::string_view line, char separator) {
  std::vector<column_name> names;
  while (!line.empty()) {
    if (names.size() == 200) return {};
    const std::string_view field = next_value(line, separator);
    const bool nanoseconds = field.find("[ns") != field.npos || field.find("(ns") != field.npos;
    const bool is_unit = separator == ' ' && field.starts_with('[');
    if (is_unit && !names.empty()) names.back().nanoseconds |= nanoseconds;
    if (is_unit) continue;
    constexpr std::string_view marks = "\"'`#%()[]:,; \t";
    std::string_view name = field;
    name.remove_prefix(std::min(name.find_first_not_of(marks), name.size()));
    name = name.substr(0, name.find_first_of(marks));
    names.push_back({std::string{name}, nanoseconds || name.ends_with("_ns")});
    std::ranges::transform(name, names.back().text.begin(), lower_case);
  }
  return names;
}

/// Returns true if the `letters.size()` names starting at index `first` each end in a different one of the letters, in
/// any order, and are otherwise equal.
template <class = void>
[[nodiscard]] bool are_components(const std::vector<column_name>& names, std::size_t first, std::string_view letters) {
  if (first + letters.size() > names.size()) return false;
  for (std::size_t i = first; i != first + letters.size(); ++i)
    if (names[i].text.empty() || names[i].prefix() != names[first].prefix()) return false;
  return std::ranges::all_of(letters, [&](char letter) {
    return std::any_of(names.begin() + static_cast<std::ptrdiff_t>(first),
                       names.begin() + static_cast<std::ptrdiff_t>(first + letters.size()),
                       [&](const column_name& c) { return c.last() == letter; });
  });
}

/// Parses a header such as `#timestamp [ns], p_RS_R_x [m], ..., q_RS_w [], ...`. The quaternion consists of the first
/// four consecutive columns whose names end in w, x, y and z and are otherwise equal. Other columns may precede it if
/// the header lists the time and the position.
template <class = void>
[[nodiscard]] pose_header parse_pose_header(std::string_view line) {
  pose_header header;
  header.is_comment = line.starts_with('#');
  while (!line.empty() && (line.front() == '#' || is_blank(line.front()))) line.remove_prefix(1);
  std::vector<column_name> names;
  for (const char separator : {find_separator(line), ' '}) {  // a comment in prose may contain a comma
    names = column_names(line, separator);
    for (std::size_t i = 0; i != names.size(); ++i)  // the quaternion in x, y, z, w, x, y, z is at the end
      if (are_components(names, i, "wxyz") && (!header.quaternion || names[*header.quaternion].prefix().empty()))
        header.quaternion = i;
    if (header.quaternion) break;
  }
  const std::size_t end = header.quaternion.value_or(names.size());
  std::optional<std::size_t> time, position;
  for (std::size_t i = 0; i != end; ++i) {
    if (names[i].is_time() && (!time || header.is_comment)) time = i;
    if (i + 3 <= end && are_components(names, i, "xyz") && names[i].last() == 'x' && names[i + 1].last() == 'y' &&
        names[i].is_position())
      position = i;
  }
  header.nanoseconds = !names.empty() && names[time.value_or(0)].nanoseconds;
  if (!header.quaternion) return header;
  std::string order;
  for (std::size_t i = end; i != end + 4; ++i) order.push_back(names[i].last());
  header.w_first = order == "wxyz";
  header.before = header.is_comment ? time.value_or(0) : 0;
  header.names = names.size() - header.before;
  header.quaternion = end - header.before;
  const bool in_order = header.w_first || order == "xyzw";
  if (in_order &&
      (header.is_comment && !time ? end >= 4 : time.value_or(0) == header.before && *header.quaternion == 4))
    return header;
  if (!in_order || end < 4)
    header.problem = "the columns are not time, position and quaternion (x y z w, or w x y z), in this order";
  else if (!time || !position || *position < header.before)
    header.problem = "the header does not name the columns of the time and the position";
  if (header.problem.empty())
    header.columns = {*time, *position, *position + 1, *position + 2, end, end + 1, end + 2, end + 3};
  for (std::size_t& column : header.columns)
    if (header.columns != usual_columns) column -= header.before;
  return header;
}

}  // namespace orbis::io::detail

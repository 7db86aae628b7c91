// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bundle adjustment problems in the text format of "Bundle Adjustment in the Large": the numbers of
/// cameras, points and observations; for each observation its camera, its point and the pixel; nine
/// numbers for each camera; three for each point. Any blanks may stand between them.
///
/// Source: S. Agarwal, N. Snavely, S. M. Seitz, R. Szeliski, "Bundle adjustment in the large", ECCV 2010,
/// and https://grail.cs.washington.edu/projects/bal.
#pragma once

#include <charconv>
#include <filesystem>
#include <istream>
#include <iterator>
#include <ostream>
#include <string>
#include <string_view>
#include <system_error>

#include <orbis/core/file.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/bal_problem.hpp>
#include <orbis/io/detail/files/bal_parser.hpp>

namespace orbis::io {

/// The problem in `text`; `where` names the source in errors. Linear in the length of the text, memory in
/// proportion to it whatever the first line says. Errors, with the line: malformed; unsupported
/// (compressed, as the files of the project's site are).
[[nodiscard]] inline result<bal_problem> parse_bal(std::string_view text, const std::filesystem::path& where = {}) {
  return detail::bal_parser{text, where}.parse();
}

/// Reads all of a stream; see `parse_bal`. Errors: unreadable, malformed, unsupported.
[[nodiscard]] inline result<bal_problem> read_bal(std::istream& in, const std::filesystem::path& where = {}) {
  const std::string text{std::istreambuf_iterator<char>{in}, std::istreambuf_iterator<char>{}};
  if (in.bad()) return fail(errc::unreadable, where.string(), "cannot be read");
  return parse_bal(text, where);
}

/// Reads a BAL file; see `parse_bal`. Errors: not_found, unreadable, malformed, unsupported.
[[nodiscard]] inline result<bal_problem> read_bal(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return fail(text.error());
  return parse_bal(*text, path);
}

/// The problem as text, with as many digits as it takes to read the same numbers back.
/// @pre the observations' indices are in range
[[nodiscard]] inline std::string format_bal(const bal_problem& problem) {
  std::string text;
  text.reserve(48 * problem.observations.size() + 24 * (9 * problem.cameras.size() + 3 * problem.points.size()) + 64);
  const auto add = [&](auto value, char after) {
    char buffer[32];
    const auto [end, failure] = std::to_chars(buffer, buffer + sizeof buffer, value);
    if (failure == std::errc{}) text.append(buffer, end);
    text += after;
  };
  add(problem.cameras.size(), ' ');
  add(problem.points.size(), ' ');
  add(problem.observations.size(), '\n');
  for (const bal_observation& o : problem.observations) {
    add(o.camera, ' ');
    add(o.point, ' ');
    add(o.pixel.x(), ' ');
    add(o.pixel.y(), '\n');
  }
  for (const auto& camera : problem.cameras)
    for (const double value : camera) add(value, '\n');
  for (const vec3& point : problem.points)
    for (int c = 0; c != 3; ++c) add(point[c], '\n');
  return text;
}

/// Writes a BAL file, whole or not at all. Errors: write_failed.
inline result<void> write_bal(const std::filesystem::path& path, const bal_problem& problem) {
  const std::string text = format_bal(problem);
  return write_file_atomically(
      path, [&](std::ostream& out) { out.write(text.data(), static_cast<std::streamsize>(text.size())); });
}

}  // namespace orbis::io

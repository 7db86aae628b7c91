// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of bal.hpp.
#pragma once

#include <charconv>
#include <istream>
#include <iterator>
#include <ostream>
#include <system_error>

#include <orbis/core/file.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/bal.hpp>
#include <orbis/io/detail/files/bal_parser.hpp>

namespace orbis::io {

ORBIS_LAZY_INLINE result<bal_problem> parse_bal(std::string_view text, const std::filesystem::path& where) {
  return detail::bal_parser{text, where}.parse();
}

ORBIS_LAZY_INLINE result<bal_problem> read_bal(std::istream& in, const std::filesystem::path& where) {
  const std::string text{std::istreambuf_iterator<char>{in}, std::istreambuf_iterator<char>{}};
  if (in.bad()) return fail(errc::unreadable, where.string(), "cannot be read");
  return parse_bal(text, where);
}

ORBIS_LAZY_INLINE result<bal_problem> read_bal(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return fail(text.error());
  return parse_bal(*text, path);
}

ORBIS_LAZY_INLINE std::string format_bal(const bal_problem& problem) {
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

ORBIS_LAZY_INLINE result<void> write_bal(const std::filesystem::path& path, const bal_problem& problem) {
  const std::string text = format_bal(problem);
  return write_file_atomically(
      path, [&](std::ostream& out) { out.write(text.data(), static_cast<std::streamsize>(text.size())); });
}

}  // namespace orbis::io

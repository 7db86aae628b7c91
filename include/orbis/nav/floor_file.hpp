// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Floor maps as files that the map servers of ROS and Nav2 read.
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <ostream>
#include <string>
#include <system_error>
#include <vector>

#include <orbis/core/file.hpp>
#include <orbis/core/result.hpp>
#include <orbis/nav/floor_map.hpp>

namespace orbis::nav {

/// Writes `path` (a `.yaml` file) and beside it an image of the same name that ends in `.pgm`: 0 is occupied, 254 free,
/// 205 unknown, the row of the largest y first. The thresholds are those with which both `map_server` and Nav2 read all
/// three back ("trinary"): `free_thresh` is 0.196, for with 0.25, which Nav2 writes by default, unknown cells are read
/// as free. Each file is replaced at once, the image first. Errors: write_failed, invalid_argument (no name, or one
/// that ends in .pgm, or has a quotation mark, a backslash or a control character in it; an empty map, or one whose
/// origin or resolution is not finite; nothing is written then).
[[nodiscard]] inline result<void> save_floor_map(const std::filesystem::path& path, const floor_map& map) {
  const auto fits = [&](double number) { return std::isfinite(number); };
  if (!path.has_filename()) return fail(errc::invalid_argument, path.string(), "is not the name of a file");
  if (map.states.empty() || !fits(map.origin.x()) || !fits(map.origin.y()) ||
      !(fits(map.resolution) && map.resolution > 0))
    return fail(errc::invalid_argument, path.string(), "the map is empty, or its place or resolution is not a number");
  const std::filesystem::path image_path = std::filesystem::path{path}.replace_extension(".pgm");
  const std::string name = image_path.filename().string();
  if (image_path == path) return fail(errc::invalid_argument, path.string(), "is the name of the image");
  for (const char c : name)
    if (c == '"' || c == '\\' || static_cast<unsigned char>(c) < 0x20)
      return fail(errc::invalid_argument, path.string(), "has a character in its name that cannot stand in the file");
  const auto number = [](double v) {
    std::array<char, 32> text{};
    const auto end = std::to_chars(text.data(), text.data() + text.size(), v).ptr;
    return std::string{text.data(), end};
  };
  const auto written = write_file_atomically(image_path, [&](std::ostream& out) {
    out << "P5\n" << std::to_string(map.states.width()) << ' ' << std::to_string(map.states.height()) << "\n255\n";
    std::vector<char> row(static_cast<std::size_t>(map.states.width()));
    for (int y = map.states.height(); y-- != 0;) {
      for (int x = 0; x != map.states.width(); ++x) {
        const floor_state s = map.states(x, y);
        const int grey = s == floor_state::occupied ? 0 : s == floor_state::free ? 254 : 205;
        row[static_cast<std::size_t>(x)] = static_cast<char>(grey);
      }
      out.write(row.data(), static_cast<std::streamsize>(row.size()));
    }
  });
  if (!written) return written;
  return write_file_atomically(path, [&](std::ostream& out) {
    out << "image: \"" << name << "\"\nmode: trinary\nresolution: " << number(map.resolution) << "\norigin: ["
        << number(map.origin.x()) << ", " << number(map.origin.y())
        << ", 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
  });
}

}  // namespace orbis::nav

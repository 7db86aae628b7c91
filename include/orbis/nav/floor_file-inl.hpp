// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of floor_file.hpp.
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <ostream>
#include <string>
#include <vector>

#include <orbis/core/file.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/nav/floor_file.hpp>

namespace orbis::nav {

ORBIS_LAZY_INLINE result<void> save_floor_map(const std::filesystem::path& path, const floor_map& map) {
  const auto fits = [&](double number) { return std::isfinite(number); };
  if (!path.has_filename()) return fail(errc::invalid_argument, path.string(), "has no file name; pass a .yaml file");
  if (map.states.empty() || !fits(map.origin.x()) || !fits(map.origin.y()) ||
      !(fits(map.resolution) && map.resolution > 0))
    return fail(errc::invalid_argument, path.string(),
                "the map is empty, its origin is not finite, or its resolution is not positive");
  const std::filesystem::path image_path = std::filesystem::path{path}.replace_extension(".pgm");
  const std::string name = image_path.filename().string();
  if (image_path == path)
    return fail(errc::invalid_argument, path.string(), "is the name of the .pgm image; pass a .yaml file");
  for (const char c : name)
    if (c == '"' || c == '\\' || static_cast<unsigned char>(c) < 0x20)
      return fail(errc::invalid_argument, path.string(),
                  "has a quotation mark, a backslash or a control character in its name; rename it");
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

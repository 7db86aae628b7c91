// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The header of a PCD file, and its points as text or binary numbers.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <orbis/core/bytes.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/detail/files/scalar_type.hpp>
#include <orbis/io/detail/text.hpp>

namespace orbis::io::detail {

struct pcd_field {
  std::string name;
  std::size_t size = 0;         ///< bytes of one element
  char type = 0;                ///< F, I or U
  std::size_t count = 1;        ///< elements per point
  std::size_t offset = 0;       ///< within a point, bytes
  std::size_t first_token = 0;  ///< within a line of text

  [[nodiscard]] std::optional<scalar_type> scalar() const {
    using enum scalar_type;
    if (type == 'F') return size == 4 ? std::optional{float32} : size == 8 ? std::optional{float64} : std::nullopt;
    constexpr scalar_type types[2][4] = {{int8, int16, int32, int64}, {uint8, uint16, uint32, uint64}};
    if ((type != 'I' && type != 'U') || !std::has_single_bit(size) || size > 8) return std::nullopt;
    return types[type == 'U' ? 1 : 0][std::countr_zero(size)];
  }
};

enum class pcd_data { ascii, binary, binary_compressed };

struct pcd_header {
  std::vector<pcd_field> fields;
  std::uint64_t width = 0, height = 1, points = 0;
  std::size_t point_size = 0;  ///< bytes
  std::size_t tokens = 0;      ///< numbers per point
  std::size_t lines = 0;       ///< number of lines of the header
  pcd_data data = pcd_data::ascii;

  [[nodiscard]] const pcd_field* find(std::string_view name) const {
    for (const pcd_field& f : fields)
      if (f.name == name) return &f;
    return nullptr;
  }
};

/// Parses the header and removes it from the front of `bytes`.
inline result<pcd_header> take_pcd_header(std::string_view& bytes, const std::string& where) {
  constexpr std::size_t max_point_size = 1 << 16;
  pcd_header header;
  bool has_width = false, has_points = false, has_data = false;
  const auto bad = [&](std::string_view why) {
    return fail(errc::malformed, where, "PCD header: " + std::string{why});
  };
  const auto number = [](std::string_view line, auto& value) { return parse_number(next_field(line), value); };
  while (!bytes.empty() && !has_data) {
    std::string_view line = trimmed(next_line(bytes));
    ++header.lines;
    if (line.empty() || line.front() == '#') continue;
    const std::string_view key = next_field(line);
    if (key == "FIELDS" || key == "COLUMNS") {
      header.fields.clear();
      for (auto name = next_field(line); !name.empty(); name = next_field(line))
        header.fields.push_back({.name = std::string{name}});
    } else if (key == "SIZE") {
      for (pcd_field& f : header.fields)
        if (!parse_number(next_field(line), f.size) || f.size == 0 || f.size > 8) return bad("a bad SIZE");
    } else if (key == "TYPE") {
      for (pcd_field& f : header.fields) {
        const std::string_view type = next_field(line);
        if (type != "F" && type != "I" && type != "U") return bad("a bad TYPE");
        f.type = type.front();
      }
    } else if (key == "COUNT") {
      for (pcd_field& f : header.fields)
        if (!parse_number(next_field(line), f.count) || f.count > max_point_size) return bad("a bad COUNT");
    } else if (key == "WIDTH") {
      if (!number(line, header.width)) return bad("a bad WIDTH");
      has_width = true;
    } else if (key == "HEIGHT") {
      if (!number(line, header.height)) return bad("a bad HEIGHT");
    } else if (key == "POINTS") {
      if (!number(line, header.points)) return bad("a bad number of POINTS");
      has_points = true;
    } else if (key == "DATA") {
      const std::string_view encoding = next_field(line);
      if (encoding == "ascii")
        header.data = pcd_data::ascii;
      else if (encoding == "binary")
        header.data = pcd_data::binary;
      else if (encoding == "binary_compressed")
        header.data = pcd_data::binary_compressed;
      else
        return bad("an unknown kind of DATA");
      has_data = true;
    } else if (key != "VERSION" && key != "VIEWPOINT") {
      return header.fields.empty() ? result<pcd_header>(fail(errc::malformed, where, "is not a PCD file"))
                                   : result<pcd_header>(bad("an unknown line"));
    }
  }
  if (!has_data || header.fields.empty()) return fail(errc::malformed, where, "is not a PCD file, or ends early");
  if (!has_width && !has_points) return bad("neither WIDTH nor POINTS");
  if (!has_width) header.width = header.points;
  constexpr std::uint64_t limit = std::uint64_t{1} << 40;
  if (header.width > limit || header.height > limit || (header.height != 0 && header.width > limit / header.height))
    return bad("WIDTH times HEIGHT is too large");
  if (!has_points) header.points = header.width * header.height;
  if (header.points != header.width * header.height) return bad("POINTS is not WIDTH times HEIGHT");
  for (pcd_field& f : header.fields) {
    if (!f.scalar()) return bad("a field with a bad SIZE or TYPE");
    f.offset = header.point_size;
    f.first_token = header.tokens;
    header.point_size += f.size * f.count;
    header.tokens += f.count;
    if (header.point_size > max_point_size) return bad("points of more than 65536 bytes");
  }
  return header;
}

/// The fields of a header that a cloud is read from.
struct pcd_columns {
  std::array<const pcd_field*, 3> xyz{};
  const pcd_field* color = nullptr;
};

inline rgb8 unpacked_rgb(std::uint32_t packed) {
  return {static_cast<std::uint8_t>(packed >> 16), static_cast<std::uint8_t>(packed >> 8),
          static_cast<std::uint8_t>(packed)};
}
inline std::uint32_t packed_rgb(const rgb8& c) {
  return static_cast<std::uint32_t>(c.r) << 16 | static_cast<std::uint32_t>(c.g) << 8 | c.b;
}

/// Reads points from lines of text. Errors: malformed, with the line.
inline result<point_cloud> read_pcd_text(std::string_view body, const pcd_header& header, const pcd_columns& columns,
                                         const vec3& origin, const std::string& where) {
  if (header.points > (body.size() + 1) / (2 * header.tokens))  // one digit per number, plus separators
    return fail(errc::malformed, where,
                "the data end early: they are too short for " + std::to_string(header.points) + " points");
  point_cloud cloud;
  cloud.points.reserve(static_cast<std::size_t>(header.points));
  std::vector<std::string_view> tokens(header.points == 0 ? 0 : header.tokens);
  std::size_t bad_line = 0;
  for_each_line(body, [&](std::string_view line, std::size_t number) {
    if (cloud.size() == header.points) return false;
    bad_line = header.lines + number;
    for (std::string_view& token : tokens) token = next_field(line);
    float xyz[3] = {};
    for (std::size_t k = 0; k != 3; ++k) {
      double value = 0.0;
      if (!parse_number(tokens[columns.xyz[k]->first_token], value)) return false;
      xyz[k] = static_cast<float>(value - origin[static_cast<int>(k)]);
    }
    if (tokens.back().empty() || !trimmed(line).empty()) return false;
    if (columns.color != nullptr) {
      double value = 0.0;
      if (!parse_number(tokens[columns.color->first_token], value)) return false;
      const bool as_float = columns.color->type == 'F';
      if (!as_float && !(value >= -2147483648.0 && value <= 4294967295.0)) return false;
      cloud.colors.push_back(unpacked_rgb(as_float ? std::bit_cast<std::uint32_t>(static_cast<float>(value))
                                                   : static_cast<std::uint32_t>(static_cast<std::int64_t>(value))));
    }
    cloud.points.emplace_back(xyz[0], xyz[1], xyz[2]);
    bad_line = 0;
    return true;
  });
  if (bad_line != 0)
    return fail(errc::malformed, where + ":" + std::to_string(bad_line),
                "the line does not match the fields of the header");
  if (cloud.size() != header.points) return fail(errc::malformed, where, "the data end early");
  return cloud;
}

/// Reads points from binary data. `at(field, i)`: address of the field of point i.
template <class At>
point_cloud read_pcd_binary(const pcd_header& header, const pcd_columns& columns, const vec3& origin, At&& at) {
  const auto n = static_cast<std::size_t>(header.points);
  point_cloud cloud;
  cloud.points.reserve(n);
  if (columns.color != nullptr) cloud.colors.reserve(n);
  const scalar_type types[3] = {*columns.xyz[0]->scalar(), *columns.xyz[1]->scalar(), *columns.xyz[2]->scalar()};
  for (std::size_t i = 0; i != n; ++i) {
    float xyz[3];
    for (std::size_t k = 0; k != 3; ++k)
      xyz[k] = static_cast<float>(load_as_double(at(*columns.xyz[k], i), types[k], std::endian::little) -
                                  origin[static_cast<int>(k)]);
    cloud.points.emplace_back(xyz[0], xyz[1], xyz[2]);
    if (columns.color != nullptr)
      cloud.colors.push_back(unpacked_rgb(load_number<std::uint32_t>(at(*columns.color, i), std::endian::little)));
  }
  return cloud;
}

}  // namespace orbis::io::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The header of a PCD file, and its points as text or binary numbers.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <orbis/core/bytes.hpp>
#include <orbis/core/quote.hpp>
#include <orbis/core/result.hpp>
#include <orbis/io/cloud_fields.hpp>
#include <orbis/io/detail/files/cloud_columns.hpp>
#include <orbis/io/detail/files/lzf.hpp>
#include <orbis/io/detail/files/scalar_type.hpp>
#include <orbis/io/detail/text.hpp>

namespace orbis::io::detail {

struct pcd_field {
  std::string name;
  std::size_t size = 0;         ///< size of one element, bytes
  char type = 0;                ///< F, I or U
  std::size_t count = 1;        ///< elements per point
  std::size_t offset = 0;       ///< offset within a point, bytes
  std::size_t first_token = 0;  ///< index of the first token within a line of text

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
  std::size_t point_size = 0;  ///< size of a point, bytes
  std::size_t tokens = 0;      ///< numbers per point
  std::size_t lines = 0;       ///< number of lines of the header
  pcd_data data = pcd_data::ascii;
  std::array<double, 7> viewpoint{0, 0, 0, 1, 0, 0, 0};
  std::string note;  ///< warning about the viewpoint
};

/// Parses seven numbers, and describes a viewpoint other than the identity in `header.note`. A zero quaternion counts
/// as the identity.
template <class = void>
void parse_viewpoint(std::string_view line, pcd_header& header) {
  const std::string text{trimmed(line)};
  std::array<double, 7> read{};
  for (double& v : read)
    if (!parse_number(next_field(line), v) || !std::isfinite(v)) {
      header.note = "VIEWPOINT " + orbis::shortened(text) + " is not seven numbers: left out";
      return;
    }
  const auto is_zero = [&](std::size_t from, std::size_t to) {
    return std::all_of(read.begin() + static_cast<std::ptrdiff_t>(from), read.begin() + static_cast<std::ptrdiff_t>(to),
                       [](double v) { return v == 0.0; });
  };
  if (is_zero(0, 3) && is_zero(4, 7)) return;
  header.viewpoint = read;
  header.note =
      "VIEWPOINT " + orbis::shortened(text) +
      " is not applied. This is correct if it is the pose of the sensor and the points are in the world frame; if it "
      "is the transform from the points to the world frame, apply it first";
}

/// Parses the header and removes it from the front of `bytes`.
template <class = void>
result<pcd_header> take_pcd_header(std::string_view& bytes, const std::string& where) {
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
        if (!parse_number(next_field(line), f.size) || f.size == 0 || f.size > 8) return bad("invalid SIZE");
    } else if (key == "TYPE") {
      for (pcd_field& f : header.fields) {
        const std::string_view type = next_field(line);
        if (type != "F" && type != "I" && type != "U") return bad("invalid TYPE");
        f.type = type.front();
      }
    } else if (key == "COUNT") {
      for (pcd_field& f : header.fields)
        if (!parse_number(next_field(line), f.count) || f.count > max_point_size) return bad("invalid COUNT");
    } else if (key == "WIDTH") {
      if (!number(line, header.width)) return bad("invalid WIDTH");
      has_width = true;
    } else if (key == "HEIGHT") {
      if (!number(line, header.height)) return bad("invalid HEIGHT");
    } else if (key == "POINTS") {
      if (!number(line, header.points)) return bad("invalid number of POINTS");
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
        return bad("unknown type of DATA");
      has_data = true;
    } else if (key == "VIEWPOINT") {
      parse_viewpoint(line, header);
    } else if (key != "VERSION") {
      return header.fields.empty() ? result<pcd_header>(fail(errc::malformed, where, "is not a PCD file"))
                                   : result<pcd_header>(bad("unknown line"));
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
    if (!f.scalar()) return bad("a field has an invalid SIZE or TYPE");
    f.offset = header.point_size;
    f.first_token = header.tokens;
    header.point_size += f.size * f.count;
    header.tokens += f.count;
    if (header.point_size > max_point_size) return bad("a point takes more than 65536 bytes");
  }
  return header;
}

/// The columns of the points: all, or only coordinates and colours. `column_of[k]`: index of the column of field k.
template <class = void>
cloud_columns make_columns(const pcd_header& header, bool all, std::vector<std::optional<std::size_t>>& column_of) {
  cloud_columns read{.columns = {},
                     .size = static_cast<std::size_t>(header.points),
                     .viewpoint = header.viewpoint,
                     .left_out = {},
                     .notes = {},
                     .is_text = header.data == pcd_data::ascii};
  if (!header.note.empty()) read.notes.push_back(header.note);
  column_of.resize(header.fields.size());
  for (std::size_t k = 0; k != column_of.size(); ++k) {
    const pcd_field& f = header.fields[k];
    if (f.count == 0 || f.name == "_" || !(all || is_point_or_color(f.name))) continue;
    column_of[k] = read.columns.size();
    read.columns.push_back(make_column(f.name, *f.scalar(), f.count, read.size, header.data == pcd_data::ascii));
  }
  return read;
}

/// Reads points from lines of text. Errors: malformed, with the line number.
template <class = void>
result<cloud_columns> read_pcd_text(std::string_view body, const pcd_header& header, bool all,
                                    const std::string& where) {
  if (header.points > (body.size() + 1) / (2 * header.tokens))  // one digit per number, plus separators
    return fail(errc::malformed, where,
                "the data ends early: it is too short for " + std::to_string(header.points) + " points");
  std::vector<std::optional<std::size_t>> column_of;
  cloud_columns read = make_columns(header, all, column_of);
  std::vector<std::string_view> tokens(header.points == 0 ? 0 : header.tokens);
  std::size_t bad_line = 0, points = 0;
  for_each_line(body, [&](std::string_view line, std::size_t number) {
    if (points == read.size) return false;
    bad_line = header.lines + number;
    for (std::string_view& token : tokens) token = next_field(line);
    if (tokens.back().empty() || !trimmed(line).empty()) return false;
    for (std::size_t k = 0; k != column_of.size(); ++k)
      for (std::size_t e = 0; column_of[k] && e != header.fields[k].count; ++e) {
        const pcd_field& f = header.fields[k];
        cloud_field& column = read.columns[*column_of[k]];
        if (store_number(column, points * f.count + e, tokens[f.first_token + e])) continue;
        if (is_point_or_color(f.name)) return false;
        read.left_out.push_back(f.name + " (no number in line " + std::to_string(bad_line) + ")");
        column.count = 0;
        column_of[k].reset();
      }
    ++points;
    bad_line = 0;
    return true;
  });
  if (bad_line != 0)
    return fail(errc::malformed, where + ":" + std::to_string(bad_line),
                "the line does not match the fields of the header");
  if (points != read.size) return fail(errc::malformed, where, "the data ends early");
  return read;
}

/// Reads points from binary data. `at(field, i)`: address of the field in point i.
template <class At>
cloud_columns read_pcd_binary(const pcd_header& header, bool all, At&& at) {
  std::vector<std::optional<std::size_t>> column_of;
  cloud_columns read = make_columns(header, all, column_of);
  for (std::size_t k = 0; k != column_of.size(); ++k) {
    if (!column_of[k]) continue;
    const pcd_field& f = header.fields[k];
    char* const to = read.columns[*column_of[k]].bytes.data();
    for (std::size_t i = 0; i != read.size; ++i) std::memcpy(to + i * f.size * f.count, at(f, i), f.size * f.count);
  }
  return read;
}

/// Reads the points of a PCD file: all columns, or only coordinates and colours. Errors: malformed.
template <class = void>
result<cloud_columns> read_pcd_columns(std::string_view bytes, const std::string& where, bool all) {
  const auto header = take_pcd_header(bytes, where);
  if (!header) return fail(header.error());
  if (header->point_size == 0) return fail(errc::unsupported, where, "the points lack x, y or z");
  const auto ends_early = [&] { return fail(errc::malformed, where, "the data ends early or is damaged"); };
  if (header->data == pcd_data::ascii) return read_pcd_text(bytes, *header, all, where);
  if (header->data == pcd_data::binary) {
    if (header->points > bytes.size() / header->point_size) return ends_early();
    return read_pcd_binary(*header, all, [&](const pcd_field& f, std::size_t i) {
      return bytes.data() + i * header->point_size + f.offset;
    });
  }
  // Compressed data is stored by field: all x, then all y, ...
  if (bytes.size() < 8) return ends_early();
  const auto compressed_size = load_number<std::uint32_t>(bytes.data());
  const auto size = load_number<std::uint32_t>(bytes.data() + 4);
  bytes.remove_prefix(8);
  if (compressed_size > bytes.size() || size % header->point_size != 0 || size / header->point_size != header->points)
    return ends_early();
  const auto data = lzf_decompress(bytes.substr(0, compressed_size), size);
  if (!data) return ends_early();
  return read_pcd_binary(*header, all, [&](const pcd_field& f, std::size_t i) {
    return data->data() + f.offset * header->points + i * f.size * f.count;
  });
}

}  // namespace orbis::io::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The header of a PLY file, and a reader for the numbers in its body.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <orbis/core/result.hpp>
#include <orbis/io/cloud_fields.hpp>
#include <orbis/io/detail/files/cloud_columns.hpp>
#include <orbis/io/detail/files/scalar_type.hpp>
#include <orbis/io/detail/text.hpp>

namespace orbis::io::detail {

struct ply_property {
  std::string name;
  scalar_type type = scalar_type::float32;
  std::optional<scalar_type> count;  ///< type of the length of a list; empty for a scalar property
};
struct ply_element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<ply_property> properties;
};
enum class ply_format { ascii, little, big };
struct ply_header {
  ply_format format = ply_format::ascii;
  std::vector<ply_element> elements;
};

template <class = void>
std::optional<scalar_type> ply_type(std::string_view name) {
  using enum scalar_type;
  constexpr std::pair<std::string_view, scalar_type> names[] = {
      {"char", int8},     {"int8", int8},       {"uchar", uint8},    {"uint8", uint8},
      {"short", int16},   {"int16", int16},     {"ushort", uint16},  {"uint16", uint16},
      {"int", int32},     {"int32", int32},     {"uint", uint32},    {"uint32", uint32},
      {"float", float32}, {"float32", float32}, {"double", float64}, {"float64", float64}};
  for (const auto& [known, type] : names)
    if (known == name) return type;
  return std::nullopt;
}

/// The name of a type in a PLY file. PLY has no 64-bit integers: they are written as double.
constexpr std::string_view ply_name(scalar_type type) {
  constexpr std::string_view names[] = {"char", "uchar",  "short",  "ushort", "int",
                                        "uint", "double", "double", "float",  "double"};
  return names[static_cast<std::size_t>(type)];
}

/// Parses the header and removes it from the front of `bytes`.
template <class = void>
result<ply_header> take_ply_header(std::string_view& bytes, const std::string& where) {
  ply_header header;
  const auto bad = [&](std::string why) { return fail(errc::malformed, where, "PLY header: " + std::move(why)); };
  if (bytes.empty() || trimmed(next_line(bytes)) != "ply") return fail(errc::malformed, where, "is not a PLY file");
  bool has_format = false;
  while (!bytes.empty()) {
    std::string_view line = next_line(bytes);
    const std::string_view word = next_field(line);
    if (word == "end_header") {
      if (!has_format) return bad("no format line");
      return header;
    }
    if (word.empty() || word == "comment" || word == "obj_info") continue;
    if (word == "format") {
      const std::string_view name = next_field(line);
      if (name == "ascii")
        header.format = ply_format::ascii;
      else if (name == "binary_little_endian")
        header.format = ply_format::little;
      else if (name == "binary_big_endian")
        header.format = ply_format::big;
      else
        return bad("unknown format");
      has_format = true;
    } else if (word == "element") {
      ply_element element{std::string{next_field(line)}, 0, {}};
      if (element.name.empty() || !parse_number(next_field(line), element.count)) return bad("invalid element line");
      header.elements.push_back(std::move(element));
    } else if (word == "property") {
      if (header.elements.empty()) return bad("a property before any element");
      std::string_view type = next_field(line);
      ply_property property;
      if (type == "list") {
        property.count = ply_type(next_field(line));
        if (!property.count || byte_size(*property.count) == 8 || *property.count == scalar_type::float32)
          return bad("the length of a list has an invalid type");
        type = next_field(line);
      }
      const auto known = ply_type(type);
      if (!known) return bad("a property of an unknown type");
      property.type = *known;
      property.name = next_field(line);
      header.elements.back().properties.push_back(std::move(property));
    } else {
      return bad("unknown line");
    }
  }
  return bad("ends early");
}

/// Reads the numbers of the body in order, in any encoding.
class ply_body {
 public:
  ply_body(std::string_view bytes, ply_format format) : left_{bytes}, format_{format} {}

  /// Reads a number. Returns false at the end of the data, or if the next field is not a number of that type.
  bool next(scalar_type type, double& value) {
    if (format_ == ply_format::ascii) return parse_number(next_field(left_), value);
    const std::size_t size = byte_size(type);
    if (left_.size() < size) return false;
    value = load_as_double(left_.data(), type, format_ == ply_format::big ? std::endian::big : std::endian::little);
    left_.remove_prefix(size);
    return true;
  }
  /// Reads a number into the column. Returns false in the same cases as `next`.
  bool store(cloud_field& column, std::size_t index) {
    if (format_ == ply_format::ascii) return store_number(column, index, next_field(left_));
    const std::size_t size = byte_size(column.type);
    if (left_.size() < size) return false;
    char* const to = column.bytes.data() + index * size;
    if (format_ == ply_format::big)
      std::reverse_copy(left_.data(), left_.data() + size, to);
    else
      std::memcpy(to, left_.data(), size);
    left_.remove_prefix(size);
    return true;
  }
  bool skip(const ply_property& property) {
    double value = 0.0, count = 1.0;
    if (property.count && (!next(*property.count, count) || !(count >= 0.0))) return false;
    for (; count >= 1.0; count -= 1.0)
      if (!next(property.type, value)) return false;
    return true;
  }
  [[nodiscard]] std::size_t bytes_left() const { return left_.size(); }
  /// Minimum size of a property in bytes.
  [[nodiscard]] std::size_t least_size(const ply_property& property) const {
    if (format_ == ply_format::ascii) return 1;
    return byte_size(property.count.value_or(property.type));
  }

 private:
  std::string_view left_;
  ply_format format_;
};

/// Reads the vertices of a PLY file: all columns, or only coordinates and colours. Errors: malformed, unsupported.
template <class = void>
result<cloud_columns> read_ply_columns(std::string_view bytes, const std::string& where, bool all) {
  const auto header = take_ply_header(bytes, where);
  if (!header) return fail(header.error());
  const bool text = header->format == ply_format::ascii;
  ply_body body{bytes, header->format};
  const auto ends_early = [&] { return fail(errc::malformed, where, "the data ends early or is damaged"); };
  std::optional<cloud_columns> read;
  std::vector<std::string> others;
  for (const ply_element& element : header->elements) {
    if (read || element.name != "vertex") {
      if (element.count != 0 && !element.properties.empty())
        others.push_back("element " + element.name + " (" + std::to_string(element.count) + ")");
      if (read) continue;
    }
    std::size_t least = 0;
    for (const ply_property& p : element.properties) least += body.least_size(p);
    if (least == 0) continue;  // takes no space in the file
    if (element.count > body.bytes_left() / least + 1) return ends_early();
    const auto points = static_cast<std::size_t>(element.count);
    if (element.name == "vertex") read.emplace().size = points;
    constexpr std::size_t skipped = std::size_t(-1);
    std::vector<std::size_t> column(element.properties.size(), skipped);
    for (std::size_t k = 0; read && k != column.size(); ++k) {
      const ply_property& p = element.properties[k];
      if (p.count && all) others.push_back("list " + p.name);
      if (p.count || !(all || is_point_or_color(p.name))) continue;
      column[k] = read->columns.size();
      read->columns.push_back(make_column(p.name, p.type, 1, points, text));
    }
    for (std::size_t i = 0; i != points; ++i)
      for (std::size_t k = 0; k != column.size(); ++k)
        if (!(column[k] == skipped ? body.skip(element.properties[k]) : body.store(read->columns[column[k]], i)))
          return ends_early();
  }
  if (!read) return fail(errc::unsupported, where, "there are no vertices");
  read->left_out = std::move(others);
  read->is_text = text;
  return *std::move(read);
}

}  // namespace orbis::io::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The named columns of a cloud file, and their interpretation as points and colours, shared by all formats.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <orbis/core/bytes.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/cloud_fields.hpp>
#include <orbis/io/detail/files/scalar_type.hpp>
#include <orbis/io/detail/text.hpp>

namespace orbis::io::detail {

/// The columns of a cloud file, not yet interpreted.
struct cloud_columns {
  std::vector<cloud_field> columns;  ///< in the order of the file; names may repeat
  std::size_t size = 0;              ///< number of points
  std::array<double, 7> viewpoint{0, 0, 0, 1, 0, 0, 0};
  std::vector<std::string> left_out;  ///< omitted parts of the file
  std::vector<std::string> notes;
  bool is_text = false;
};

constexpr std::string_view coordinate_names[] = {"x", "y", "z"};
constexpr std::array<std::string_view, 3> color_names[] = {
    {"red", "green", "blue"}, {"r", "g", "b"}, {"diffuse_red", "diffuse_green", "diffuse_blue"}};
constexpr std::string_view packed_color_names[] = {"rgb", "rgba"};

/// Returns true if `name`, in any case, is equal to `known`, a name in lower case.
template <class = void>
[[nodiscard]] bool is_name(std::string_view name, std::string_view known) {
  return std::ranges::equal(name, known, {}, lower_case);
}
template <class = void>
[[nodiscard]] bool is_one_of(std::string_view name, std::span<const std::string_view> known) {
  return std::ranges::any_of(known, [&](std::string_view k) { return is_name(name, k); });
}
template <class = void>
[[nodiscard]] bool is_coordinate(std::string_view name) {
  return is_one_of(name, coordinate_names);
}

/// Returns true if points or colours may be read from columns with this name.
template <class = void>
[[nodiscard]] bool is_point_or_color(std::string_view name) {
  return is_coordinate(name) || is_one_of(name, packed_color_names) ||
         std::ranges::any_of(color_names, [&](const auto& names) { return is_one_of(name, names); });
}

/// A column of zeros for `points` points. Coordinates from text are stored as double, regardless of the declared type.
template <class = void>
[[nodiscard]] cloud_field make_column(std::string name, scalar_type type, std::size_t count, std::size_t points,
                                      bool text) {
  if (text && is_coordinate(name)) type = scalar_type::float64;
  return {std::move(name), type, count, std::string(points * count * byte_size(type), '\0')};
}

/// Stores the number `token` at `index` in the column. If the column's type cannot represent it (such as an integer of
/// more than 24 bits in a float), the column is converted to float64. Returns false if `token` is not a number.
template <class = void>
[[nodiscard]] bool store_number(cloud_field& column, std::size_t index, std::string_view token) {
  const auto store = [&](auto value) {
    if (!parse_number(token, value)) return false;
    if constexpr (std::is_same_v<decltype(value), float>)
      if (std::int64_t whole = 0; parse_number(token, whole) && double{value} != static_cast<double>(whole))
        return false;
    store_little_endian(column.bytes.data() + index * sizeof value, value);
    return true;
  };
  if (with_type(column.type, store)) return true;
  double value = 0.0;
  if (column.type == scalar_type::float64 || !parse_number(token, value)) return false;
  const std::size_t size = byte_size(column.type), n = column.bytes.size() / size;
  std::string wide(n * sizeof value, '\0');
  for (std::size_t i = 0; i != index; ++i)
    store_little_endian(wide.data() + i * sizeof value,
                        load_as_double(column.bytes.data() + i * size, column.type, std::endian::little));
  column.bytes = std::move(wide);
  column.type = scalar_type::float64;
  return store(value);
}

[[nodiscard]] inline double number_at(const cloud_field& column, std::size_t index) {
  return load_as_double(column.bytes.data() + index * byte_size(column.type), column.type, std::endian::little);
}

inline rgb8 unpacked_rgb(std::uint32_t packed) {
  return {static_cast<std::uint8_t>(packed >> 16), static_cast<std::uint8_t>(packed >> 8),
          static_cast<std::uint8_t>(packed)};
}
inline std::uint32_t packed_rgb(const rgb8& c) {
  return static_cast<std::uint32_t>(c.r) << 16 | static_cast<std::uint32_t>(c.g) << 8 | c.b;
}

/// Formats a number for a message, with at most six digits.
template <class = void>
std::string shortened(double value) {
  char text[32];
  const auto [end, failure] = std::to_chars(text, text + sizeof text, value, std::chars_format::general, 6);
  return {text, end};
}

/// Colours from three columns. PLY does not define the range of a channel, so it is inferred from the largest value in
/// all channels of the same kind (8-bit, wider integer, floating point). For floating-point values up to 2 the range is
/// 0 to 1, because rounding, interpolation and lighting may raise them above 1. For other values it is the smallest
/// range of 8, 12 or 16 bits that contains them. Notes report a range that differs from that of the type.
template <class = void>
std::vector<rgb8> channel_colors(const std::array<const cloud_field*, 3>& channels, std::size_t size,
                                 std::vector<std::string>& notes) {
  const auto is_byte = [](scalar_type type) { return byte_size(type) == 1; };
  double most_integer = 0.0, most_floating = 0.0;
  for (const cloud_field* c : channels)
    if (double& most = is_floating(c->type) ? most_floating : most_integer; !is_byte(c->type))
      for (std::size_t i = 0; i != size; ++i)
        if (const double v = number_at(*c, i); std::isfinite(v)) most = std::max(most, v);
  const auto full_scale = [](double most) { return most <= 255.0 ? 255.0 : most <= 4095.0 ? 4095.0 : 65535.0; };
  std::vector<rgb8> colors(size);
  constexpr std::uint8_t rgb8::*channel_of[] = {&rgb8::r, &rgb8::g, &rgb8::b};
  std::string last_note;
  for (std::size_t k = 0; k != 3; ++k) {
    const cloud_field& c = *channels[k];
    const double most = is_floating(c.type) ? most_floating : most_integer;
    const double range = is_byte(c.type) ? 255.0 : is_floating(c.type) && most <= 2.0 ? 1.0 : full_scale(most);
    for (std::size_t i = 0; i != size; ++i) {
      double v = number_at(c, i);
      if (c.type == scalar_type::int8 && v < 0.0) v += 256.0;  // bytes declared as signed
      v = std::round(v * 255.0 / range);
      colors[i].*channel_of[k] = static_cast<std::uint8_t>(v >= 0.0 ? std::min(255.0, v) : 0.0);
    }
    const bool usual = is_byte(c.type) || (is_floating(c.type) && most <= 1.001) ||
                       (c.type == scalar_type::uint16 && most > 65535.0 / 4.0) || most == 0.0;
    if (usual) continue;
    std::string note = std::string{"colours are "} + (is_floating(c.type) ? "floating-point numbers" : "integers") +
                       " up to " + shortened(most) + ": interpreted as 0 ... " +
                       std::to_string(static_cast<int>(range));
    if (note != last_note) notes.push_back(last_note = std::move(note));
  }
  return colors;
}

/// Colours packed as 0xAARRGGBB into integers or the bits of floats; empty if the column contains other numbers. In
/// text files, whole numbers in a float column are treated as integers, because their bits as floats would give colours
/// with an unusual alpha. `alpha` receives the most significant bytes.
template <class = void>
std::optional<std::vector<rgb8>> packed_colors(const cloud_field& column, std::size_t size, bool is_text,
                                               std::string& alpha, std::vector<std::string>& notes) {
  std::vector<rgb8> colors(size);
  alpha.resize(size);
  bool are_integers = true, are_zero = true;
  for (std::size_t i = 0; i != size && are_integers; ++i) {
    const double v = number_at(column, i);
    are_integers = v >= -2147483648.0 && v <= 4294967295.0 && v == std::floor(v);
    are_zero = are_zero && v == 0.0;
  }
  const bool are_bits = column.type == scalar_type::float32 && !(is_text && are_integers && !are_zero);
  if (!are_bits && !are_integers) return std::nullopt;
  if (!are_bits && is_floating(column.type))
    notes.push_back(column.name + " is declared as floating-point, but has whole numbers: read as packed integers");
  for (std::size_t i = 0; i != size; ++i) {
    const auto packed = are_bits ? load_number<std::uint32_t>(column.bytes.data() + 4 * i)
                                 : static_cast<std::uint32_t>(static_cast<std::int64_t>(number_at(column, i)));
    colors[i] = unpacked_rgb(packed);
    alpha[i] = static_cast<char>(packed >> 24);
  }
  return colors;
}

/// Interprets columns as points, colours and other fields. `origin` is subtracted from the coordinates before they are
/// converted to float. Errors: unsupported (no x, y and z).
template <class = void>
result<cloud_with_fields> to_cloud(cloud_columns&& read, const std::string& where, const vec3& origin) {
  cloud_with_fields out;
  out.viewpoint = read.viewpoint;
  out.notes = std::move(read.notes);
  const std::size_t n = read.size;
  std::vector<bool> used(read.columns.size(), false);
  const auto find = [&](std::string_view name) -> const cloud_field* {
    auto at = std::ranges::find(read.columns, name, &cloud_field::name);
    if (at == read.columns.end())
      at = std::ranges::find_if(read.columns, [&](const cloud_field& c) { return is_name(c.name, name); });
    return at == read.columns.end() || at->count != 1 ? nullptr : &*at;
  };
  const auto use = [&](const cloud_field* column) {
    used[static_cast<std::size_t>(column - read.columns.data())] = true;
  };

  const cloud_field* xyz[3] = {find("x"), find("y"), find("z")};
  for (const cloud_field* c : xyz) {
    if (c == nullptr) return fail(errc::unsupported, where, "the points lack x, y or z");
    use(c);
  }
  out.cloud.points.resize(n);
  for (int axis = 0; axis != 3; ++axis)
    for (std::size_t i = 0; i != n; ++i)
      out.cloud.points[i][axis] = static_cast<float>(number_at(*xyz[axis], i) - origin[axis]);

  bool colored = false;
  std::string obstacle;
  for (std::size_t set = 0; set != std::size(color_names) && !colored; ++set) {
    const auto& names = color_names[set];
    const std::array channels{find(names[0]), find(names[1]), find(names[2])};
    const auto missing = std::ranges::find(channels, nullptr);
    colored = missing == channels.end();
    if (colored) {
      out.cloud.colors = channel_colors(channels, n, out.notes);
      for (const cloud_field* c : channels) use(c);
    } else if (std::ranges::count(channels, nullptr) == 1) {
      obstacle = std::string{names[static_cast<std::size_t>(missing - channels.begin())]} + " is missing";
    }
  }
  std::string alpha;
  for (std::size_t k = 0; k != std::size(packed_color_names) && !colored; ++k) {
    const cloud_field* column = find(packed_color_names[k]);
    if (column == nullptr || byte_size(column->type) < 4) continue;
    auto colors = packed_colors(*column, n, read.is_text, alpha, out.notes);
    colored = colors.has_value();
    if (!colored) obstacle = column->name + " does not contain packed colours";
    if (!colored) continue;
    out.cloud.colors = *std::move(colors);
    use(column);
    const bool constant = std::ranges::all_of(alpha, [&](char a) { return a == 0; }) ||
                          std::ranges::all_of(alpha, [&](char a) { return a == '\xFF'; });
    if (!constant && find("alpha") == nullptr) out.fields.push_back({"alpha", scalar_type::uint8, 1, std::move(alpha)});
  }

  if (!colored && !obstacle.empty()) out.notes.push_back("no colours: " + obstacle);

  std::set<std::string> taken{"x", "y", "z"};  // names of fields in output files
  if (colored) taken.insert({"red", "green", "blue", "rgb"});
  if (!out.fields.empty()) taken.insert("alpha");
  for (std::size_t k = 0; k != used.size(); ++k) {
    cloud_field& field = read.columns[k];
    if (used[k] || field.name.empty() || field.name == "_" || field.count == 0) continue;  // "_": padding
    if (taken.insert(field.name).second)
      out.fields.push_back(std::move(field));
    else
      read.left_out.push_back("repeated " + field.name);
  }
  if (!read.left_out.empty()) out.notes.push_back("left out: " + joined(read.left_out));
  return out;
}

}  // namespace orbis::io::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Point clouds in PCD files (version 0.7: ascii, binary, binary_compressed).
///
/// Source: the Point Cloud Library's documentation of the file format. Points that are not finite are
/// kept: in an organised cloud the place of a point says which pixel it came from. The viewpoint is
/// not applied.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <orbis/core/bytes.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/result.hpp>
#include <orbis/io/detail/lzf.hpp>
#include <orbis/io/detail/scalar_type.hpp>
#include <orbis/io/detail/text.hpp>

namespace orbis::io {

/// A cloud whose points may be the pixels of an image, row after row.
struct organized_cloud {
  point_cloud cloud;
  std::size_t width = 0;   ///< width * height == cloud.size()
  std::size_t height = 0;  ///< 1 where the cloud is not organised
};

enum class pcd_encoding { ascii, binary, binary_compressed };

struct pcd_options {
  pcd_encoding encoding = pcd_encoding::binary_compressed;
};

namespace detail {

struct pcd_field {
  std::string name;
  std::size_t size = 0;         ///< bytes of one element
  char type = 0;                ///< F, I or U
  std::size_t count = 1;        ///< elements for each point
  std::size_t offset = 0;       ///< in a point, bytes
  std::size_t first_token = 0;  ///< in a line of text

  [[nodiscard]] std::optional<scalar_type> scalar() const {
    using enum scalar_type;
    if (type == 'F') return size == 4 ? std::optional{float32} : size == 8 ? std::optional{float64} : std::nullopt;
    constexpr scalar_type types[2][4] = {{int8, int16, int32, int64}, {uint8, uint16, uint32, uint64}};
    if ((type != 'I' && type != 'U') || !std::has_single_bit(size) || size > 8) return std::nullopt;
    return types[type == 'U' ? 1 : 0][std::countr_zero(size)];
  }
};

struct pcd_header {
  std::vector<pcd_field> fields;
  std::uint64_t width = 0, height = 1, points = 0;
  std::size_t point_size = 0;  ///< bytes
  std::size_t tokens = 0;      ///< numbers for each point
  std::size_t lines = 0;       ///< of the header
  pcd_encoding encoding = pcd_encoding::ascii;

  [[nodiscard]] const pcd_field* find(std::string_view name) const {
    for (const pcd_field& f : fields)
      if (f.name == name) return &f;
    return nullptr;
  }
};

/// Takes the header off the front of `bytes`.
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
        header.encoding = pcd_encoding::ascii;
      else if (encoding == "binary")
        header.encoding = pcd_encoding::binary;
      else if (encoding == "binary_compressed")
        header.encoding = pcd_encoding::binary_compressed;
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
    return bad("absurd WIDTH and HEIGHT");
  if (!has_points) header.points = header.width * header.height;
  if (header.points != header.width * header.height) return bad("POINTS is not WIDTH times HEIGHT");
  for (pcd_field& f : header.fields) {
    if (!f.scalar()) return bad("a field with a bad SIZE or TYPE");
    f.offset = header.point_size;
    f.first_token = header.tokens;
    header.point_size += f.size * f.count;
    header.tokens += f.count;
    if (header.point_size > max_point_size) return bad("absurdly large points");
  }
  return header;
}

/// The fields of a header that make a cloud.
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

/// From lines of text. Errors: malformed, with the line.
inline result<point_cloud> read_pcd_text(std::string_view body, const pcd_header& header, const pcd_columns& columns,
                                         const std::string& where) {
  if (header.points > body.size() / header.tokens + 1)
    return fail(errc::malformed, where,
                "the data end early: there cannot be " + std::to_string(header.points) + " points in them");
  point_cloud cloud;
  cloud.points.reserve(static_cast<std::size_t>(header.points));
  std::vector<std::string_view> tokens(header.tokens);
  std::size_t bad_line = 0;
  for_each_line(body, [&](std::string_view line, std::size_t number) {
    if (cloud.size() == header.points) return false;
    bad_line = header.lines + number;
    for (std::string_view& token : tokens) token = next_field(line);
    float xyz[3] = {};
    for (std::size_t k = 0; k != 3; ++k) {
      double value = 0.0;
      if (!parse_number(tokens[columns.xyz[k]->first_token], value)) return false;
      xyz[k] = static_cast<float>(value);
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
  if (bad_line != 0) return fail(errc::malformed, where + ":" + std::to_string(bad_line), "not a point of this file");
  if (cloud.size() != header.points) return fail(errc::malformed, where, "the data end early");
  return cloud;
}

/// From binary data. `at(field, i)`: where the field of point i lies.
template <class At>
point_cloud read_pcd_binary(const pcd_header& header, const pcd_columns& columns, At&& at) {
  const auto n = static_cast<std::size_t>(header.points);
  point_cloud cloud;
  cloud.points.reserve(n);
  if (columns.color != nullptr) cloud.colors.reserve(n);
  const scalar_type types[3] = {*columns.xyz[0]->scalar(), *columns.xyz[1]->scalar(), *columns.xyz[2]->scalar()};
  for (std::size_t i = 0; i != n; ++i) {
    float xyz[3];
    for (std::size_t k = 0; k != 3; ++k)
      xyz[k] = static_cast<float>(load_as_double(at(*columns.xyz[k], i), types[k], std::endian::little));
    cloud.points.emplace_back(xyz[0], xyz[1], xyz[2]);
    if (columns.color != nullptr)
      cloud.colors.push_back(unpacked_rgb(load_number<std::uint32_t>(at(*columns.color, i), std::endian::little)));
  }
  return cloud;
}

}  // namespace detail

/// A PCD file in memory: `x y z` of any type, and `rgb` or `rgba` (packed, float or integer) where
/// they are there. All else is passed over. Errors: malformed (damaged, truncated), unsupported (no
/// x, y and z).
[[nodiscard]] inline result<organized_cloud> parse_pcd(std::string_view bytes, const std::string& where = {}) {
  using namespace detail;
  const auto header = take_pcd_header(bytes, where);
  if (!header) return fail(header.error());
  pcd_columns columns{{header->find("x"), header->find("y"), header->find("z")}, header->find("rgb")};
  for (const pcd_field* f : columns.xyz)
    if (f == nullptr || f->count != 1) return fail(errc::unsupported, where, "the points have no x, y and z");
  if (columns.color == nullptr) columns.color = header->find("rgba");
  if (columns.color != nullptr && (columns.color->size != 4 || columns.color->count != 1)) columns.color = nullptr;
  const auto ends_early = [&] { return fail(errc::malformed, where, "the data end early or are damaged"); };

  organized_cloud out;
  out.width = static_cast<std::size_t>(header->width);
  out.height = static_cast<std::size_t>(header->height);
  if (header->encoding == pcd_encoding::ascii) {
    auto cloud = read_pcd_text(bytes, *header, columns, where);
    if (!cloud) return fail(cloud.error());
    out.cloud = *std::move(cloud);
    return out;
  }
  if (header->encoding == pcd_encoding::binary) {
    if (header->points > bytes.size() / header->point_size) return ends_early();
    out.cloud = read_pcd_binary(*header, columns, [&](const pcd_field& f, std::size_t i) {
      return bytes.data() + i * header->point_size + f.offset;
    });
    return out;
  }
  // Compressed: all x, then all y, ...
  if (bytes.size() < 8) return ends_early();
  const auto compressed_size = load_number<std::uint32_t>(bytes.data());
  const auto size = load_number<std::uint32_t>(bytes.data() + 4);
  bytes.remove_prefix(8);
  if (compressed_size > bytes.size() || size % header->point_size != 0 || size / header->point_size != header->points)
    return ends_early();
  const auto data = detail::lzf_decompress(bytes.substr(0, compressed_size), size);
  if (!data) return ends_early();
  out.cloud = read_pcd_binary(*header, columns, [&](const pcd_field& f, std::size_t i) {
    return data->data() + f.offset * header->points + i * f.size * f.count;
  });
  return out;
}

/// Reads a PCD file with the shape of its image, if it has one; see `parse_pcd`.
/// Errors: not_found, unreadable, malformed, unsupported.
[[nodiscard]] inline result<organized_cloud> read_organized_pcd(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return fail(bytes.error());
  return parse_pcd(*bytes, path.string());
}

/// Reads a PCD file. Errors: as `read_organized_pcd`.
[[nodiscard]] inline result<point_cloud> read_pcd(const std::filesystem::path& path) {
  auto organized = read_organized_pcd(path);
  if (!organized) return fail(organized.error());
  return std::move(organized->cloud);
}

/// Writes a cloud as a PCD file, whole or not at all: `x y z`, and `rgb` (packed into a float, as PCL
/// has it) if there are colours. Errors: write_failed, invalid_argument (the shape is not that of
/// the points; more than 4 GiB to compress).
inline result<void> write_pcd(const std::filesystem::path& path, const organized_cloud& organized,
                              const pcd_options& options = {}) {
  const point_cloud& cloud = organized.cloud;
  const std::size_t n = cloud.size();
  if (organized.width * organized.height != n)
    return fail(errc::invalid_argument, path.string(), "width times height is not the number of points");
  assert(cloud.colors.empty() || cloud.colors.size() == n);
  const bool colored = cloud.has_colors();
  const auto choose = [&](const char* with, const char* without) { return colored ? with : without; };
  std::string bytes =
      std::string{"# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z"} +
      choose(" rgb\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1", "\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1") + "\nWIDTH " +
      std::to_string(organized.width) + "\nHEIGHT " + std::to_string(organized.height) +
      "\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + std::to_string(n) + "\nDATA ";
  switch (options.encoding) {
    case pcd_encoding::ascii: {
      bytes += "ascii\n";
      const auto add = [&](float value) {
        char buffer[64];
        bytes.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr) += ' ';
      };
      for (std::size_t i = 0; i != n; ++i) {
        for (const float v : cloud.points[i]) add(v);
        if (colored) add(std::bit_cast<float>(detail::packed_rgb(cloud.colors[i])));
        bytes.back() = '\n';
      }
      break;
    }
    case pcd_encoding::binary:
      bytes += "binary\n";
      for (std::size_t i = 0; i != n; ++i) {
        for (const float v : cloud.points[i]) append_little_endian(bytes, v);
        if (colored) append_little_endian(bytes, detail::packed_rgb(cloud.colors[i]));
      }
      break;
    case pcd_encoding::binary_compressed: {
      bytes += "binary_compressed\n";
      std::string columns;
      for (const int axis : {0, 1, 2})
        for (const vec3f& p : cloud.points) append_little_endian(columns, p[axis]);
      for (const rgb8& c : cloud.colors) append_little_endian(columns, detail::packed_rgb(c));
      const std::string compressed = detail::lzf_compress(columns);
      if (std::max(columns.size(), compressed.size()) > UINT32_MAX)
        return fail(errc::invalid_argument, path.string(), "too large for binary_compressed, use binary");
      append_little_endian(bytes, static_cast<std::uint32_t>(compressed.size()));
      append_little_endian(bytes, static_cast<std::uint32_t>(columns.size()));
      bytes += compressed;
      break;
    }
  }
  return write_file_atomically(
      path, [&](std::ostream& out) { out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())); });
}

/// Writes an unorganised cloud as a PCD file.
inline result<void> write_pcd(const std::filesystem::path& path, point_cloud cloud, const pcd_options& options = {}) {
  const std::size_t n = cloud.size();
  return write_pcd(path, organized_cloud{std::move(cloud), n, 1}, options);
}

}  // namespace orbis::io

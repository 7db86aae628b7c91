// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Point clouds in PLY files.
///
/// Source: G. Turk, "The PLY polygon file format", 1994.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <ostream>
#include <ranges>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <orbis/core/bytes.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/detail/files/ply_format.hpp>
#include <orbis/io/detail/files/scalar_type.hpp>

namespace orbis::io {

enum class ply_encoding { ascii, binary };  ///< binary: little-endian

struct ply_options {
  ply_encoding encoding = ply_encoding::binary;
  /// Added to the coordinates as they are written, metres: what `parse_ply` took off. If it is not zero they are
  /// written as double.
  vec3 origin = zeros<vec3>();
};

/// The vertices of a PLY file in memory: `x y z` of any type and, where they are there, `red green
/// blue` (8-bit as they are, 16-bit scaled, floating point from 0 to 1). All else is passed over. `origin` is taken off
/// the coordinates before they become floats, which are no finer than half a metre at 5000 km.
/// Errors: malformed (damaged, truncated), unsupported (no vertices with x, y and z).
[[nodiscard]] inline result<point_cloud> parse_ply(std::string_view bytes, const std::string& where = {},
                                                   const vec3& origin = zeros<vec3>()) {
  using namespace detail;
  const auto header = take_ply_header(bytes, where);
  if (!header) return fail(header.error());
  ply_body body{bytes, header->format};
  const auto ends_early = [&] { return fail(errc::malformed, where, "the data end early or are damaged"); };

  for (const ply_element& element : header->elements) {
    std::size_t least = 0;
    for (const ply_property& p : element.properties) least += body.least_size(p);
    if (least == 0) continue;  // takes no space in the file
    if (element.count > body.bytes_left() / least + 1) return ends_early();
    if (element.name != "vertex") {
      for (std::uint64_t i = 0; i != element.count; ++i)
        for (const ply_property& p : element.properties)
          if (!body.skip(p)) return ends_early();
      continue;
    }

    constexpr std::string_view names[6] = {"x", "y", "z", "red", "green", "blue"};
    std::vector<int> role(element.properties.size(), -1);
    std::array<detail::scalar_type, 6> type{};
    unsigned found = 0;
    for (std::size_t k = 0; k != role.size(); ++k)
      for (std::size_t r = 0; r != 6; ++r)
        if (element.properties[k].name == names[r] && !element.properties[k].count && (found >> r & 1U) == 0) {
          role[k] = static_cast<int>(r);
          type[r] = element.properties[k].type;
          found |= 1U << r;
        }
    if ((found & 7U) != 7U) return fail(errc::unsupported, where, "the vertices have no x, y and z");
    const bool colored = found == 63U;
    const auto channel = [](double v, detail::scalar_type t) {
      if (t == detail::scalar_type::float32 || t == detail::scalar_type::float64) v *= 255.0;
      if (t == detail::scalar_type::uint16) v /= 257.0;
      return static_cast<std::uint8_t>(v >= 0.0 ? std::min(255.0, std::round(v)) : 0.0);
    };

    point_cloud cloud;
    cloud.points.reserve(static_cast<std::size_t>(element.count));
    if (colored) cloud.colors.reserve(static_cast<std::size_t>(element.count));
    for (std::uint64_t i = 0; i != element.count; ++i) {
      double v[6] = {};
      for (std::size_t k = 0; k != role.size(); ++k) {
        const bool ok = role[k] < 0 ? body.skip(element.properties[k])
                                    : body.next(element.properties[k].type, v[static_cast<std::size_t>(role[k])]);
        if (!ok) return ends_early();
      }
      cloud.points.emplace_back(static_cast<float>(v[0] - origin.x()), static_cast<float>(v[1] - origin.y()),
                                static_cast<float>(v[2] - origin.z()));
      if (colored) cloud.colors.push_back({channel(v[3], type[3]), channel(v[4], type[4]), channel(v[5], type[5])});
    }
    return cloud;
  }
  return fail(errc::unsupported, where, "there are no vertices");
}

/// Reads a PLY file; see `parse_ply`. Errors: not_found, unreadable, malformed, unsupported.
[[nodiscard]] inline result<point_cloud> read_ply(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return fail(bytes.error());
  return parse_ply(*bytes, path.string());
}

namespace detail {

/// Writes `count` vertices, of which `point(i)` and `color(i)` are the parts, block by block.
template <class Point, class Color>
result<void> write_ply_vertices(const std::filesystem::path& path, std::size_t count, bool colored, const Point& point,
                                const Color& color, const ply_options& options) {
  const bool binary = options.encoding == ply_encoding::binary;
  const bool far = !options.origin.isZero();
  const std::string axis = far ? "\nproperty double " : "\nproperty float ";
  return write_file_atomically(path, [&](std::ostream& out) {
    std::string bytes = std::string{"ply\nformat "} + (binary ? "binary_little_endian" : "ascii") +
                        " 1.0\nelement vertex " + std::to_string(count) + axis + "x" + axis + "y" + axis + "z\n" +
                        (colored ? "property uchar red\nproperty uchar green\nproperty uchar blue\n" : "") +
                        "end_header\n";
    const auto flush = [&] {
      out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
      bytes.clear();
    };
    constexpr std::size_t block = 65536;
    bytes.reserve(block + 256);
    for (std::size_t i = 0; i != count; ++i) {
      const std::array<float, 3> xyz = point(i);
      const rgb8 c = colored ? color(i) : rgb8{};
      const auto for_each_coordinate = [&](const auto& f) {
        for (std::size_t a = 0; a != 3; ++a)
          if (far)
            f(double{xyz[a]} + options.origin[static_cast<int>(a)]);
          else
            f(xyz[a]);
      };
      if (binary) {
        for_each_coordinate([&](auto v) { append_little_endian(bytes, v); });
        if (colored)
          for (const std::uint8_t v : {c.r, c.g, c.b}) append_little_endian(bytes, v);
      } else {
        char buffer[64];
        for_each_coordinate([&](auto v) {
          bytes.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, v).ptr);
          bytes += ' ';
        });
        if (colored)
          for (const unsigned v : {c.r, c.g, c.b}) bytes += std::to_string(v) + ' ';
        bytes.back() = '\n';
      }
      if (bytes.size() >= block) flush();
    }
    flush();
  });
}

}  // namespace detail

/// Writes points (as float), and their colours if there are any, as a PLY file, whole or not at all.
/// @pre colors.empty() || colors.size() == size of points. Errors: write_failed.
template <point_range Points>
result<void> write_ply(const std::filesystem::path& path, const Points& points, std::span<const rgb8> colors,
                       const ply_options& options = {}) {
  const auto count = static_cast<std::size_t>(std::ranges::size(points));
  assert(colors.empty() || colors.size() == count);
  const auto first = std::ranges::begin(points);
  return detail::write_ply_vertices(
      path, count, !colors.empty(),
      [&](std::size_t i) {
        return coordinates<float>(first[static_cast<std::ranges::range_difference_t<const Points>>(i)]);
      },
      [&](std::size_t i) { return colors[i]; }, options);
}

/// Writes a cloud as a PLY file: `x y z`, with `red green blue` if it has colours.
inline result<void> write_ply(const std::filesystem::path& path, const point_cloud& cloud,
                              const ply_options& options = {}) {
  return write_ply(path, cloud.points, std::span<const rgb8>{cloud.colors}, options);
}

/// Writes the points of a cloud that a filter kept, without making a cloud of them. @pre indices are of the cloud
inline result<void> write_ply(const std::filesystem::path& path, const point_cloud& cloud,
                              std::span<const std::uint32_t> indices, const ply_options& options = {}) {
  return detail::write_ply_vertices(
      path, indices.size(), cloud.has_colors(),
      [&](std::size_t i) { return coordinates<float>(cloud.points[indices[i]]); },
      [&](std::size_t i) { return cloud.colors[indices[i]]; }, options);
}

}  // namespace orbis::io

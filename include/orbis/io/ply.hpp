// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Point clouds in PLY files.
///
/// Source: G. Turk, "The PLY polygon file format", 1994.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <ranges>
#include <span>
#include <string>
#include <string_view>

#include <orbis/core/image.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/cloud_fields.hpp>

namespace orbis::io {

enum class ply_encoding { ascii, binary };  ///< binary: little-endian

struct ply_options {
  ply_encoding encoding = ply_encoding::binary;
  /// Offset added to the coordinates on writing, metres: the origin that `parse_ply` subtracted. If it is not zero,
  /// coordinates are written as double.
  vec3 origin = zeros<vec3>();
};

/// Parses the vertices of a PLY file in memory: `x y z` of any type and, if present, colours: `red green blue`,
/// `r g b`, `diffuse_red diffuse_green diffuse_blue`, or packed `rgb` or `rgba`. 8-bit channels are unchanged. The
/// range of floating-point channels is 0 to 1 if no value exceeds 2. Otherwise it is, like that of wider integers, the
/// first of 0 to 255, 0 to 4095 and 0 to 65535 that contains all values. Ignores everything else. `origin` is
/// subtracted from the coordinates before they are converted to float, whose resolution is half a metre at 5000 km.
/// Errors: malformed (damaged, truncated), unsupported (no vertices with x, y and z).
ORBIS_LAZY [[nodiscard]] result<point_cloud> parse_ply(std::string_view bytes, const std::string& where = {},
                                                       const vec3& origin = zeros<vec3>());

/// Parses a PLY file like `parse_ply`, and keeps all other properties of the vertices except lists. Notes report
/// omitted data, and colours whose range differs from that of their type. Errors: those of `parse_ply`.
ORBIS_LAZY [[nodiscard]] result<cloud_with_fields> parse_ply_with_fields(std::string_view bytes,
                                                                         const std::string& where = {},
                                                                         const vec3& origin = zeros<vec3>());

/// Reads a PLY file; see `parse_ply`. Errors: not_found, unreadable, malformed, unsupported.
ORBIS_LAZY [[nodiscard]] result<point_cloud> read_ply(const std::filesystem::path& path);

namespace detail {

struct ply_vertex {
  std::array<float, 3> xyz{};
  rgb8 color{};
};

/// A type-erased source of vertices: `read(of, begin, out)` fills `out` with the vertices from index `begin` on.
struct ply_vertices {
  const void* of = nullptr;
  void (*read)(const void* of, std::size_t begin, std::span<ply_vertex> out) = nullptr;
  std::size_t count = 0;
  bool colored = false;
  std::span<const cloud_field> fields{};
  std::span<const std::uint32_t> rows{};  ///< for each vertex: its index in the fields
};

/// Writes vertices in blocks.
ORBIS_LAZY [[nodiscard]] result<void> write_ply_vertices(const std::filesystem::path& path,
                                                         const ply_vertices& vertices, const ply_options& options);

}  // namespace detail

/// Writes points (as float), and their colours if there are any, to a PLY file atomically. @pre colors.empty() ||
/// colors.size() == number of points. Errors: write_failed.
template <point_range Points>
result<void> write_ply(const std::filesystem::path& path, const Points& points, std::span<const rgb8> colors,
                       const ply_options& options = {}) {
  const auto count = static_cast<std::size_t>(std::ranges::size(points));
  assert(colors.empty() || colors.size() == count);
  const auto read = [&](std::size_t begin, std::span<detail::ply_vertex> out) {
    auto point = std::ranges::begin(points) + static_cast<std::ranges::range_difference_t<const Points>>(begin);
    for (detail::ply_vertex& vertex : out) vertex.xyz = coordinates<float>(*point++);
    for (std::size_t i = 0; !colors.empty() && i != out.size(); ++i) out[i].color = colors[begin + i];
  };
  const auto call = [](const void* of, std::size_t begin, std::span<detail::ply_vertex> out) {
    (*static_cast<const decltype(read)*>(of))(begin, out);
  };
  return detail::write_ply_vertices(path, {&read, call, count, !colors.empty()}, options);
}

/// Writes a cloud as a PLY file: `x y z`, with `red green blue` if it has colours.
ORBIS_LAZY result<void> write_ply(const std::filesystem::path& path, const point_cloud& cloud,
                                  const ply_options& options = {});

/// Writes the points with the given indices, such as those that a filter kept, without copying them to another cloud.
/// @pre each index < cloud.size()
ORBIS_LAZY result<void> write_ply(const std::filesystem::path& path, const point_cloud& cloud,
                                  std::span<const std::uint32_t> indices, const ply_options& options = {});

/// Writes the points with the given indices, with all of their fields: a field `f` with several values per point as the
/// properties `f_0`, `f_1`, ..., 64-bit integers as double. @pre each index < cloud.cloud.size()
ORBIS_LAZY result<void> write_ply(const std::filesystem::path& path, const cloud_with_fields& cloud,
                                  std::span<const std::uint32_t> indices, const ply_options& options = {});

}  // namespace orbis::io

#ifndef ORBIS_COMPILED
#include <orbis/io/ply-inl.hpp>
#endif

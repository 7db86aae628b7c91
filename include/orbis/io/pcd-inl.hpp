// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of pcd.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <cstddef>
#include <ostream>
#include <type_traits>
#include <utility>

#include <orbis/core/bytes.hpp>
#include <orbis/core/file.hpp>
#include <orbis/io/detail/files/cloud_columns.hpp>
#include <orbis/io/detail/files/lzf.hpp>
#include <orbis/io/detail/files/pcd_format.hpp>
#include <orbis/io/detail/files/scalar_type.hpp>
#include <orbis/io/pcd.hpp>

namespace orbis::io {

ORBIS_LAZY_INLINE result<point_cloud> parse_pcd(std::string_view bytes, const std::string& where, const vec3& origin) {
  auto columns = detail::read_pcd_columns(bytes, where, false);
  if (!columns) return fail(columns.error());
  auto read = detail::to_cloud(*std::move(columns), where, origin);
  if (!read) return fail(read.error());
  return std::move(read->cloud);
}

ORBIS_LAZY_INLINE result<cloud_with_fields> parse_pcd_with_fields(std::string_view bytes, const std::string& where,
                                                                  const vec3& origin) {
  auto columns = detail::read_pcd_columns(bytes, where, true);
  if (!columns) return fail(columns.error());
  return detail::to_cloud(*std::move(columns), where, origin);
}

ORBIS_LAZY_INLINE result<point_cloud> read_pcd(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return fail(bytes.error());
  return parse_pcd(*bytes, path.string());
}

namespace detail {

/// Writes the points with the indices `at(0)`, ..., `at(n - 1)`.
template <class At>
result<void> write_indexed_pcd(const std::filesystem::path& path, const point_cloud& cloud,
                               std::span<const cloud_field> fields, const std::array<double, 7>& viewpoint,
                               const vec3& origin, std::size_t n, At&& at) {
  const bool far = !origin.isZero();
  std::string names = "FIELDS", sizes = "SIZE", types = "TYPE", counts = "COUNT", place, columns;
  const auto add_field = [&](const std::string& name, scalar_type type, std::size_t count) {
    names += ' ' + name;
    sizes += ' ' + std::to_string(byte_size(type));
    types += is_floating(type)                                                             ? " F"
             : with_type(type, [](auto zero) { return std::is_signed_v<decltype(zero)>; }) ? " I"
                                                                                           : " U";
    counts += ' ' + std::to_string(count);
  };
  for (const int axis : {0, 1, 2}) {
    add_field(std::string{coordinate_names[axis]}, far ? scalar_type::float64 : scalar_type::float32, 1);
    for (std::size_t i = 0; i != n; ++i)
      if (const float v = cloud.points[at(i)][axis]; far)
        append_little_endian(columns, double{v} + origin[axis]);
      else
        append_little_endian(columns, v);
  }
  if (cloud.has_colors()) add_field("rgb", scalar_type::float32, 1);
  for (std::size_t i = 0; cloud.has_colors() && i != n; ++i)
    append_little_endian(columns, packed_rgb(cloud.colors[at(i)]));
  for (const cloud_field& field : fields) {
    add_field(field.name, field.type, field.count);
    const std::size_t size = byte_size(field.type) * field.count;
    for (std::size_t i = 0; i != n; ++i) columns.append(field.bytes, at(i) * size, size);
  }
  for (const double v : viewpoint) {
    char text[64];
    place.append(1, ' ').append(text, std::to_chars(text, text + sizeof text, v).ptr);
  }
  const std::string compressed = lzf_compress(columns);
  if (std::max(columns.size(), compressed.size()) > UINT32_MAX)
    return fail(errc::invalid_argument, path.string(),
                "more than 4 GiB, the limit of compressed PCD files; write a PLY file");
  std::string bytes = "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n" + names + '\n' + sizes + '\n' +
                      types + '\n' + counts + "\nWIDTH " + std::to_string(n) + "\nHEIGHT 1\nVIEWPOINT" + place +
                      "\nPOINTS " + std::to_string(n) + "\nDATA binary_compressed\n";
  append_little_endian(bytes, static_cast<std::uint32_t>(compressed.size()));
  append_little_endian(bytes, static_cast<std::uint32_t>(columns.size()));
  bytes += compressed;
  return write_file_atomically(
      path, [&](std::ostream& out) { out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())); });
}

}  // namespace detail

ORBIS_LAZY_INLINE result<void> write_pcd(const std::filesystem::path& path, const point_cloud& cloud) {
  assert(cloud.colors.empty() || cloud.colors.size() == cloud.size());
  return detail::write_indexed_pcd(path, cloud, {}, cloud_with_fields{}.viewpoint, zeros<vec3>(), cloud.size(),
                                   [](std::size_t i) { return i; });
}

ORBIS_LAZY_INLINE result<void> write_pcd(const std::filesystem::path& path, const cloud_with_fields& cloud,
                                         std::span<const std::uint32_t> indices, const vec3& origin) {
  return detail::write_indexed_pcd(path, cloud.cloud, cloud.fields, cloud.viewpoint, origin, indices.size(),
                                   [&](std::size_t i) { return std::size_t{indices[i]}; });
}

}  // namespace orbis::io

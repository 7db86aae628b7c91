// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of ply.hpp.
#pragma once

#include <algorithm>
#include <charconv>
#include <ostream>
#include <set>
#include <type_traits>

#include <orbis/core/bytes.hpp>
#include <orbis/core/file.hpp>
#include <orbis/io/detail/files/cloud_columns.hpp>
#include <orbis/io/detail/files/ply_format.hpp>
#include <orbis/io/detail/files/scalar_type.hpp>
#include <orbis/io/ply.hpp>

namespace orbis::io {

ORBIS_LAZY_INLINE result<point_cloud> parse_ply(std::string_view bytes, const std::string& where, const vec3& origin) {
  auto columns = detail::read_ply_columns(bytes, where, false);
  if (!columns) return fail(columns.error());
  auto read = detail::to_cloud(*std::move(columns), where, origin);
  if (!read) return fail(read.error());
  return std::move(read->cloud);
}

ORBIS_LAZY_INLINE result<cloud_with_fields> parse_ply_with_fields(std::string_view bytes, const std::string& where,
                                                                  const vec3& origin) {
  auto columns = detail::read_ply_columns(bytes, where, true);
  if (!columns) return fail(columns.error());
  return detail::to_cloud(*std::move(columns), where, origin);
}

ORBIS_LAZY_INLINE result<point_cloud> read_ply(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return fail(bytes.error());
  return parse_ply(*bytes, path.string());
}

namespace detail {

ORBIS_LAZY_INLINE result<void> write_ply_vertices(const std::filesystem::path& path, const ply_vertices& vertices,
                                                  const ply_options& options) {
  const bool binary = options.encoding == ply_encoding::binary;
  const bool far = !options.origin.isZero();
  const std::string axis = far ? "\nproperty double " : "\nproperty float ";
  return write_file_atomically(path, [&](std::ostream& out) {
    std::string bytes = std::string{"ply\nformat "} + (binary ? "binary_little_endian" : "ascii") +
                        " 1.0\nelement vertex " + std::to_string(vertices.count) + axis + "x" + axis + "y" + axis +
                        "z\n" +
                        (vertices.colored ? "property uchar red\nproperty uchar green\nproperty uchar blue\n" : "");
    std::set<std::string> taken;
    for (const cloud_field& field : vertices.fields)
      if (field.count == 1) taken.insert(field.name);
    for (const cloud_field& field : vertices.fields)
      for (std::size_t e = 0, number = 0; e != field.count; ++e) {
        std::string name = field.name;
        while (field.count != 1 && !taken.insert(name = field.name + '_' + std::to_string(number++)).second) {
        }
        bytes += "property " + std::string{ply_name(field.type)} + ' ' + name + '\n';
      }
    bytes += "end_header\n";
    const auto flush = [&] {
      out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
      bytes.clear();
    };
    constexpr std::size_t block = 65536;
    bytes.reserve(block + 256);
    std::array<ply_vertex, 256> some;
    for (std::size_t begin = 0; begin < vertices.count; begin += some.size()) {
      const std::span chunk{some.data(), std::min(some.size(), vertices.count - begin)};
      vertices.read(vertices.of, begin, chunk);
      for (std::size_t i = 0; i != chunk.size(); ++i) {
        const auto& [xyz, c] = chunk[i];
        const auto put = [&](auto v) {
          char text[64];
          if (binary)
            append_little_endian(bytes, v);
          else
            bytes.append(text, std::to_chars(text, text + sizeof text, v).ptr) += ' ';
        };
        for (std::size_t a = 0; a != 3; ++a)
          if (far)
            put(double{xyz[a]} + options.origin[static_cast<int>(a)]);
          else
            put(xyz[a]);
        if (vertices.colored)
          for (const std::uint8_t v : {c.r, c.g, c.b}) put(v);
        for (const cloud_field& field : vertices.fields)
          for (std::size_t e = 0; e != field.count; ++e)
            with_type(field.type, [&](auto zero) {
              using number = decltype(zero);
              const auto v = load_number<number>(field.bytes.data() +
                                                 (vertices.rows[begin + i] * field.count + e) * sizeof(number));
              if constexpr (std::is_integral_v<number> && sizeof(number) == 8)
                put(static_cast<double>(v));
              else
                put(v);
            });
        if (!binary) bytes.back() = '\n';
        if (bytes.size() >= block) flush();
      }
    }
    flush();
  });
}

}  // namespace detail

ORBIS_LAZY_INLINE result<void> write_ply(const std::filesystem::path& path, const point_cloud& cloud,
                                         const ply_options& options) {
  return write_ply(path, cloud.points, std::span<const rgb8>{cloud.colors}, options);
}

namespace detail {

template <class = void>
result<void> write_indexed_ply(const std::filesystem::path& path, const point_cloud& cloud,
                               std::span<const cloud_field> fields, std::span<const std::uint32_t> indices,
                               const ply_options& options) {
  const auto read = [&](std::size_t begin, std::span<ply_vertex> out) {
    for (std::size_t i = 0; i != out.size(); ++i) {
      const std::uint32_t at = indices[begin + i];
      out[i].xyz = coordinates<float>(cloud.points[at]);
      if (cloud.has_colors()) out[i].color = cloud.colors[at];
    }
  };
  const auto call = [](const void* of, std::size_t begin, std::span<ply_vertex> out) {
    (*static_cast<const decltype(read)*>(of))(begin, out);
  };
  return write_ply_vertices(path, {&read, call, indices.size(), cloud.has_colors(), fields, indices}, options);
}

}  // namespace detail

ORBIS_LAZY_INLINE result<void> write_ply(const std::filesystem::path& path, const point_cloud& cloud,
                                         std::span<const std::uint32_t> indices, const ply_options& options) {
  return detail::write_indexed_ply(path, cloud, {}, indices, options);
}

ORBIS_LAZY_INLINE result<void> write_ply(const std::filesystem::path& path, const cloud_with_fields& cloud,
                                         std::span<const std::uint32_t> indices, const ply_options& options) {
  return detail::write_indexed_ply(path, cloud.cloud, cloud.fields, indices, options);
}

}  // namespace orbis::io

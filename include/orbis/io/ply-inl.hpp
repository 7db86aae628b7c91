// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Function definitions of ply.hpp.
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <ostream>
#include <vector>

#include <orbis/core/bytes.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/io/detail/files/ply_format.hpp>
#include <orbis/io/detail/files/scalar_type.hpp>
#include <orbis/io/ply.hpp>

namespace orbis::io {

ORBIS_INLINE result<point_cloud> parse_ply(std::string_view bytes, const std::string& where, const vec3& origin) {
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

ORBIS_INLINE result<point_cloud> read_ply(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return fail(bytes.error());
  return parse_ply(*bytes, path.string());
}

namespace detail {

ORBIS_INLINE result<void> write_ply_vertices(const std::filesystem::path& path, const ply_vertices& vertices,
                                             const ply_options& options) {
  const bool binary = options.encoding == ply_encoding::binary;
  const bool far = !options.origin.isZero();
  const std::string axis = far ? "\nproperty double " : "\nproperty float ";
  return write_file_atomically(path, [&](std::ostream& out) {
    std::string bytes =
        std::string{"ply\nformat "} + (binary ? "binary_little_endian" : "ascii") + " 1.0\nelement vertex " +
        std::to_string(vertices.count) + axis + "x" + axis + "y" + axis + "z\n" +
        (vertices.colored ? "property uchar red\nproperty uchar green\nproperty uchar blue\n" : "") + "end_header\n";
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
      for (const auto& [xyz, c] : chunk) {
        const auto for_each_coordinate = [&, &xyz = xyz](const auto& f) {
          for (std::size_t a = 0; a != 3; ++a)
            if (far)
              f(double{xyz[a]} + options.origin[static_cast<int>(a)]);
            else
              f(xyz[a]);
        };
        if (binary) {
          for_each_coordinate([&](auto v) { append_little_endian(bytes, v); });
          if (vertices.colored)
            for (const std::uint8_t v : {c.r, c.g, c.b}) append_little_endian(bytes, v);
        } else {
          char buffer[64];
          for_each_coordinate([&](auto v) {
            bytes.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, v).ptr);
            bytes += ' ';
          });
          if (vertices.colored)
            for (const unsigned v : {c.r, c.g, c.b}) bytes += std::to_string(v) + ' ';
          bytes.back() = '\n';
        }
        if (bytes.size() >= block) flush();
      }
    }
    flush();
  });
}

}  // namespace detail

ORBIS_INLINE result<void> write_ply(const std::filesystem::path& path, const point_cloud& cloud,
                                    const ply_options& options) {
  return write_ply(path, cloud.points, std::span<const rgb8>{cloud.colors}, options);
}

ORBIS_INLINE result<void> write_ply(const std::filesystem::path& path, const point_cloud& cloud,
                                    std::span<const std::uint32_t> indices, const ply_options& options) {
  const auto read = [&](std::size_t begin, std::span<detail::ply_vertex> out) {
    for (std::size_t i = 0; i != out.size(); ++i) {
      const std::uint32_t at = indices[begin + i];
      out[i].xyz = coordinates<float>(cloud.points[at]);
      if (cloud.has_colors()) out[i].color = cloud.colors[at];
    }
  };
  const auto call = [](const void* of, std::size_t begin, std::span<detail::ply_vertex> out) {
    (*static_cast<const decltype(read)*>(of))(begin, out);
  };
  return detail::write_ply_vertices(path, {&read, call, indices.size(), cloud.has_colors()}, options);
}

}  // namespace orbis::io

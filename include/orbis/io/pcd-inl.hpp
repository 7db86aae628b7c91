// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Function definitions of pcd.hpp.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstdint>
#include <ostream>

#include <orbis/core/bytes.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/io/detail/files/lzf.hpp>
#include <orbis/io/detail/files/pcd_format.hpp>
#include <orbis/io/pcd.hpp>

namespace orbis::io {

ORBIS_INLINE result<point_cloud> parse_pcd(std::string_view bytes, const std::string& where, const vec3& origin) {
  using namespace detail;
  const auto header = take_pcd_header(bytes, where);
  if (!header) return fail(header.error());
  pcd_columns columns{{header->find("x"), header->find("y"), header->find("z")}, header->find("rgb")};
  for (const pcd_field* f : columns.xyz)
    if (f == nullptr || f->count != 1) return fail(errc::unsupported, where, "the points have no x, y and z");
  if (columns.color == nullptr) columns.color = header->find("rgba");
  if (columns.color != nullptr && (columns.color->size != 4 || columns.color->count != 1)) columns.color = nullptr;
  const auto ends_early = [&] { return fail(errc::malformed, where, "the data end early or are damaged"); };

  if (header->data == pcd_data::ascii) return read_pcd_text(bytes, *header, columns, origin, where);
  if (header->data == pcd_data::binary) {
    if (header->points > bytes.size() / header->point_size) return ends_early();
    return read_pcd_binary(*header, columns, origin, [&](const pcd_field& f, std::size_t i) {
      return bytes.data() + i * header->point_size + f.offset;
    });
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
  return read_pcd_binary(*header, columns, origin, [&](const pcd_field& f, std::size_t i) {
    return data->data() + f.offset * header->points + i * f.size * f.count;
  });
}

ORBIS_INLINE result<point_cloud> read_pcd(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return fail(bytes.error());
  return parse_pcd(*bytes, path.string());
}

ORBIS_INLINE result<void> write_pcd(const std::filesystem::path& path, const point_cloud& cloud) {
  const std::string n = std::to_string(cloud.size());
  assert(cloud.colors.empty() || cloud.colors.size() == cloud.size());
  const auto choose = [&](const char* with, const char* without) { return cloud.has_colors() ? with : without; };
  std::string bytes =
      std::string{"# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z"} +
      choose(" rgb\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1", "\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1") + "\nWIDTH " +
      n + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + n + "\nDATA binary_compressed\n";
  std::string columns;
  for (const int axis : {0, 1, 2})
    for (const vec3f& p : cloud.points) append_little_endian(columns, p[axis]);
  for (const rgb8& c : cloud.colors) append_little_endian(columns, detail::packed_rgb(c));
  const std::string compressed = detail::lzf_compress(columns);
  if (std::max(columns.size(), compressed.size()) > UINT32_MAX)
    return fail(errc::invalid_argument, path.string(),
                "more than 4 GiB, the limit of compressed PCD files; write a PLY file");
  append_little_endian(bytes, static_cast<std::uint32_t>(compressed.size()));
  append_little_endian(bytes, static_cast<std::uint32_t>(columns.size()));
  bytes += compressed;
  return write_file_atomically(
      path, [&](std::ostream& out) { out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())); });
}

}  // namespace orbis::io

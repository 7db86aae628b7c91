// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Function definitions of cloud_file.hpp.
#pragma once

#include <string_view>

#include <orbis/core/file.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/io/cloud_file.hpp>
#include <orbis/io/pcd.hpp>
#include <orbis/io/ply.hpp>

namespace orbis::io {

namespace detail {

enum class cloud_format { ply, pcd };

inline result<cloud_format> cloud_format_of(std::string_view bytes, const std::filesystem::path& path) {
  if (bytes.starts_with("ply\n") || bytes.starts_with("ply\r") || path.extension() == ".ply") return cloud_format::ply;
  if (path.extension() == ".pcd" || bytes.starts_with("# .PCD") || bytes.starts_with("VERSION "))
    return cloud_format::pcd;
  return fail(errc::unsupported, path.string(), "is neither a PLY nor a PCD file");
}

}  // namespace detail

ORBIS_INLINE result<point_cloud> read_cloud(const std::filesystem::path& path, const vec3& origin) {
  const auto bytes = read_file(path);
  if (!bytes) return fail(bytes.error());
  const auto format = detail::cloud_format_of(*bytes, path);
  if (!format) return fail(format.error());
  return *format == detail::cloud_format::ply ? parse_ply(*bytes, path.string(), origin)
                                              : parse_pcd(*bytes, path.string(), origin);
}

ORBIS_INLINE result<cloud_with_fields> read_cloud_with_fields(const std::filesystem::path& path, const vec3& origin) {
  const auto bytes = read_file(path);
  if (!bytes) return fail(bytes.error());
  const auto format = detail::cloud_format_of(*bytes, path);
  if (!format) return fail(format.error());
  return *format == detail::cloud_format::ply ? parse_ply_with_fields(*bytes, path.string(), origin)
                                              : parse_pcd_with_fields(*bytes, path.string(), origin);
}

ORBIS_INLINE result<void> write_cloud(const std::filesystem::path& path, const cloud_with_fields& cloud,
                                      std::span<const std::uint32_t> indices, const vec3& origin) {
  return path.extension() == ".pcd" ? write_pcd(path, cloud, indices, origin)
                                    : write_ply(path, cloud, indices, {.origin = origin});
}

}  // namespace orbis::io

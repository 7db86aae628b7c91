// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of cloud_file.hpp.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>

#include <orbis/core/file.hpp>
#include <orbis/io/cloud_file.hpp>
#include <orbis/io/detail/text.hpp>
#include <orbis/io/pcd.hpp>
#include <orbis/io/ply.hpp>

namespace orbis::io {

ORBIS_LAZY_INLINE std::optional<cloud_format> cloud_format_by_extension(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  const auto is = [&](std::string_view known) { return std::ranges::equal(extension, known, {}, detail::lower_case); };
  return is(".ply") ? std::optional{cloud_format::ply} : is(".pcd") ? std::optional{cloud_format::pcd} : std::nullopt;
}

namespace detail {

template <class = void>
result<cloud_format> detect_cloud_format(std::string_view bytes, const std::filesystem::path& path) {
  if (bytes.starts_with("ply\n") || bytes.starts_with("ply\r")) return cloud_format::ply;
  if (bytes.starts_with("# .PCD") || bytes.starts_with("VERSION ")) return cloud_format::pcd;
  if (const auto format = cloud_format_by_extension(path)) return *format;
  return fail(errc::unsupported, path.string(), "is neither a PLY nor a PCD file");
}

}  // namespace detail

ORBIS_LAZY_INLINE result<point_cloud> read_cloud(const std::filesystem::path& path, const vec3& origin) {
  const auto bytes = read_file(path);
  if (!bytes) return fail(bytes.error());
  const auto format = detail::detect_cloud_format(*bytes, path);
  if (!format) return fail(format.error());
  return *format == cloud_format::ply ? parse_ply(*bytes, path.string(), origin)
                                      : parse_pcd(*bytes, path.string(), origin);
}

ORBIS_LAZY_INLINE result<cloud_with_fields> read_cloud_with_fields(const std::filesystem::path& path,
                                                                   const vec3& origin) {
  const auto bytes = read_file(path);
  if (!bytes) return fail(bytes.error());
  const auto format = detail::detect_cloud_format(*bytes, path);
  if (!format) return fail(format.error());
  return *format == cloud_format::ply ? parse_ply_with_fields(*bytes, path.string(), origin)
                                      : parse_pcd_with_fields(*bytes, path.string(), origin);
}

ORBIS_LAZY_INLINE result<void> write_cloud(const std::filesystem::path& path, const cloud_with_fields& cloud,
                                           std::span<const std::uint32_t> indices, const vec3& origin) {
  const auto format = cloud_format_by_extension(path);
  if (!format) return fail(errc::invalid_argument, path.string(), "must end in .ply or .pcd");
  return *format == cloud_format::pcd ? write_pcd(path, cloud, indices, origin)
                                      : write_ply(path, cloud, indices, {.origin = origin});
}

}  // namespace orbis::io

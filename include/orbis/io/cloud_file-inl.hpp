// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Function definitions of cloud_file.hpp.
#pragma once

#include <string>
#include <string_view>

#include <orbis/core/file.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/io/cloud_file.hpp>
#include <orbis/io/pcd.hpp>
#include <orbis/io/ply.hpp>

namespace orbis::io {

ORBIS_INLINE result<point_cloud> read_cloud(const std::filesystem::path& path, const vec3& origin) {
  const auto bytes = read_file(path);
  if (!bytes) return fail(bytes.error());
  const std::string_view start = std::string_view{*bytes}.substr(0, 256);
  if (start.starts_with("ply\n") || start.starts_with("ply\r") || path.extension() == ".ply")
    return parse_ply(*bytes, path.string(), origin);
  if (path.extension() == ".pcd" || start.starts_with("# .PCD") || start.starts_with("VERSION "))
    return parse_pcd(*bytes, path.string(), origin);
  return fail(errc::unsupported, path.string(), "is neither a PLY nor a PCD file");
}

}  // namespace orbis::io

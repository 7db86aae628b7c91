// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Point clouds from files, by what the file is.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

#include <orbis/core/file.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/pcd.hpp>
#include <orbis/io/ply.hpp>

namespace orbis::io {

/// Reads a PLY or PCD file: what it is, its first bytes say (PLY), or else its name's ending.
/// `origin` is taken off the coordinates before they become floats: for clouds far from where their coordinates begin.
/// Errors: not_found, unreadable, malformed, unsupported (neither of the two).
[[nodiscard]] inline result<point_cloud> read_cloud(const std::filesystem::path& path,
                                                    const vec3& origin = zeros<vec3>()) {
  const auto bytes = read_file(path);
  if (!bytes) return fail(bytes.error());
  const std::string_view start = std::string_view{*bytes}.substr(0, 256);
  if (start.starts_with("ply\n") || start.starts_with("ply\r") || path.extension() == ".ply")
    return parse_ply(*bytes, path.string(), origin);
  if (path.extension() == ".pcd" || start.starts_with("# .PCD") || start.starts_with("VERSION ")) {
    auto organized = parse_pcd(*bytes, path.string(), origin);
    if (!organized) return fail(organized.error());
    return std::move(organized->cloud);
  }
  return fail(errc::unsupported, path.string(), "is neither a PLY nor a PCD file");
}

}  // namespace orbis::io

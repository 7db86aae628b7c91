// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Point clouds in PCD files (version 0.7: ascii, binary, binary_compressed).
///
/// Source: the Point Cloud Library's documentation of the file format. Points that are not finite are
/// kept: in an organised cloud the place of a point says which pixel it came from. The viewpoint is
/// not applied.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include <orbis/core/point_cloud.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>

namespace orbis::io {

/// A cloud whose points may be the pixels of an image, row after row.
struct organized_cloud {
  point_cloud cloud;
  std::size_t width = 0;   ///< width * height == cloud.size()
  std::size_t height = 0;  ///< 1 where the cloud is not organised
};

enum class pcd_encoding { ascii, binary, binary_compressed };

struct pcd_options {
  pcd_encoding encoding = pcd_encoding::binary_compressed;
};

/// A PCD file in memory: `x y z` of any type, and `rgb` or `rgba` (packed, float or integer) where
/// they are there. All else is passed over. `origin` is taken off the coordinates before they become floats.
/// Errors: malformed (damaged, truncated), unsupported (no x, y and z).
[[nodiscard]] result<organized_cloud> parse_pcd(std::string_view bytes, const std::string& where = {},
                                                const vec3& origin = zeros<vec3>());

/// Reads a PCD file with the shape of its image, if it has one; see `parse_pcd`.
/// Errors: not_found, unreadable, malformed, unsupported.
[[nodiscard]] result<organized_cloud> read_organized_pcd(const std::filesystem::path& path);

/// Reads a PCD file. Errors: as `read_organized_pcd`.
[[nodiscard]] result<point_cloud> read_pcd(const std::filesystem::path& path);

/// Writes a cloud as a PCD file, whole or not at all: `x y z`, and `rgb` (packed into a float, as PCL
/// has it) if there are colours. Errors: write_failed, invalid_argument (the shape is not that of
/// the points; more than 4 GiB to compress).
result<void> write_pcd(const std::filesystem::path& path, const organized_cloud& organized,
                       const pcd_options& options = {});

/// Writes an unorganised cloud as a PCD file.
result<void> write_pcd(const std::filesystem::path& path, point_cloud cloud, const pcd_options& options = {});

}  // namespace orbis::io

#ifndef ORBIS_COMPILED
#include <orbis/io/pcd-inl.hpp>
#endif

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Point clouds in PCD files (version 0.7: ascii, binary, binary_compressed).
///
/// Source: the Point Cloud Library's documentation of the file format. Non-finite points are kept, because in an
/// organised cloud the index of a point determines its pixel. The viewpoint is not applied, because it may be either
/// the pose of the sensor, with points in the world frame, or the transform from the points to the world frame.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include <orbis/core/inline.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/cloud_fields.hpp>

namespace orbis::io {

/// Parses a PCD file in memory: `x y z` of any type and, if present, colours in the same forms as for `parse_ply`.
/// Ignores all other fields. `origin` is subtracted from the coordinates before they are converted to float. Errors:
/// malformed (damaged, truncated), unsupported (no x, y and z).
ORBIS_LAZY [[nodiscard]] result<point_cloud> parse_pcd(std::string_view bytes, const std::string& where = {},
                                                       const vec3& origin = zeros<vec3>());

/// Parses a PCD file like `parse_pcd`, and keeps all other fields and the viewpoint. Notes report a viewpoint other
/// than the identity, omitted data, and colours whose range differs from that of their type. Errors: those of
/// `parse_pcd`.
ORBIS_LAZY [[nodiscard]] result<cloud_with_fields> parse_pcd_with_fields(std::string_view bytes,
                                                                         const std::string& where = {},
                                                                         const vec3& origin = zeros<vec3>());

/// Reads a PCD file; see `parse_pcd`. Errors: not_found, unreadable, malformed, unsupported.
ORBIS_LAZY [[nodiscard]] result<point_cloud> read_pcd(const std::filesystem::path& path);

/// Writes a cloud as a PCD file (binary_compressed) atomically: `x y z`, and `rgb` (packed into a float, as in PCL) if
/// there are colours. Errors: write_failed, invalid_argument (more than 4 GiB).
ORBIS_LAZY result<void> write_pcd(const std::filesystem::path& path, const point_cloud& cloud);

/// Writes the points with the given indices, with all of their fields and the viewpoint. `origin` (metres) is added to
/// the coordinates; if it is not zero, they are written as double. @pre each index < cloud.cloud.size()
ORBIS_LAZY result<void> write_pcd(const std::filesystem::path& path, const cloud_with_fields& cloud,
                                  std::span<const std::uint32_t> indices, const vec3& origin = zeros<vec3>());

}  // namespace orbis::io

#ifndef ORBIS_COMPILED
#include <orbis/io/pcd-inl.hpp>
#endif

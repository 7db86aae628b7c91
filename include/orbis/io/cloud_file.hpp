// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Point clouds from files in any supported format.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>

#include <orbis/core/point_cloud.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/cloud_fields.hpp>

namespace orbis::io {

enum class cloud_format { ply, pcd };

/// The format by the extension of a path, in upper or lower case; none for other extensions.
[[nodiscard]] std::optional<cloud_format> cloud_format_by_extension(const std::filesystem::path& path);

/// Reads a PLY or PCD file, detected by its first bytes or otherwise by its extension. `origin` is subtracted
/// from the coordinates before they are converted to float: for clouds far from their coordinate origin. Errors:
/// not_found, unreadable, malformed, unsupported (neither of the two).
[[nodiscard]] result<point_cloud> read_cloud(const std::filesystem::path& path, const vec3& origin = zeros<vec3>());

/// Reads a cloud like `read_cloud`, with all other numbers that the file has for each point. Errors: those of
/// `read_cloud`.
[[nodiscard]] result<cloud_with_fields> read_cloud_with_fields(const std::filesystem::path& path,
                                                               const vec3& origin = zeros<vec3>());

/// Writes points of a cloud by index, with all of their fields, in the format of the extension. `origin` is added to
/// the coordinates, metres. @pre indices are of the cloud. Errors: write_failed, invalid_argument (an extension that is
/// neither `.ply` nor `.pcd`; more than a PCD file can hold).
result<void> write_cloud(const std::filesystem::path& path, const cloud_with_fields& cloud,
                         std::span<const std::uint32_t> indices, const vec3& origin = zeros<vec3>());

}  // namespace orbis::io

#ifndef ORBIS_COMPILED
#include <orbis/io/cloud_file-inl.hpp>
#endif

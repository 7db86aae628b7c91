// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Point clouds from files in any supported format.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>

#include <orbis/core/inline.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/cloud_fields.hpp>

namespace orbis::io {

enum class cloud_format { ply, pcd };

/// The format that corresponds to the extension of a path, in upper or lower case; empty for other extensions.
ORBIS_LAZY [[nodiscard]] std::optional<cloud_format> cloud_format_by_extension(const std::filesystem::path& path);

/// Reads a PLY or PCD file; its first bytes, or otherwise its extension, determine the format. `origin` is subtracted
/// from the coordinates before they are converted to float, to preserve the accuracy of clouds far from their
/// coordinate origin. Errors: not_found, unreadable, malformed, unsupported (neither PLY nor PCD).
ORBIS_LAZY [[nodiscard]] result<point_cloud> read_cloud(const std::filesystem::path& path,
                                                        const vec3& origin = zeros<vec3>());

/// Reads a cloud like `read_cloud`, and keeps all other values that the file stores for each point. Errors: those of
/// `read_cloud`.
ORBIS_LAZY [[nodiscard]] result<cloud_with_fields> read_cloud_with_fields(const std::filesystem::path& path,
                                                                          const vec3& origin = zeros<vec3>());

/// Writes the points with the given indices, with all of their fields, in the format that corresponds to the extension.
/// `origin` (metres) is added to the coordinates. @pre each index < cloud.cloud.size(). Errors: write_failed,
/// invalid_argument (an extension that is neither `.ply` nor `.pcd`; more points than a PCD file can hold).
ORBIS_LAZY result<void> write_cloud(const std::filesystem::path& path, const cloud_with_fields& cloud,
                                    std::span<const std::uint32_t> indices, const vec3& origin = zeros<vec3>());

}  // namespace orbis::io

#ifndef ORBIS_COMPILED
#include <orbis/io/cloud_file-inl.hpp>
#endif

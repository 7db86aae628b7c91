// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Point clouds from files in any supported format.
#pragma once

#include <filesystem>

#include <orbis/core/point_cloud.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>

namespace orbis::io {

/// Reads a PLY or PCD file, detected by its first bytes (PLY) or otherwise by its extension. `origin` is subtracted
/// from the coordinates before they are converted to float: for clouds far from their coordinate origin. Errors:
/// not_found, unreadable, malformed, unsupported (neither of the two).
[[nodiscard]] result<point_cloud> read_cloud(const std::filesystem::path& path, const vec3& origin = zeros<vec3>());

}  // namespace orbis::io

#ifndef ORBIS_COMPILED
#include <orbis/io/cloud_file-inl.hpp>
#endif

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Point clouds from files, by what the file is.
#pragma once

#include <filesystem>

#include <orbis/core/point_cloud.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>

namespace orbis::io {

/// Reads a PLY or PCD file: what it is, its first bytes say (PLY), or else its name's ending.
/// `origin` is taken off the coordinates before they become floats: for clouds far from where their coordinates begin.
/// Errors: not_found, unreadable, malformed, unsupported (neither of the two).
[[nodiscard]] result<point_cloud> read_cloud(const std::filesystem::path& path, const vec3& origin = zeros<vec3>());

}  // namespace orbis::io

#ifndef ORBIS_COMPILED
#include <orbis/io/cloud_file-inl.hpp>
#endif

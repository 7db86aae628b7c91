// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Floor map files for the map servers of ROS and Nav2.
#pragma once

#include <filesystem>

#include <orbis/core/inline.hpp>
#include <orbis/core/result.hpp>
#include <orbis/nav/floor_map.hpp>

namespace orbis::nav {

/// Writes `path` (a `.yaml` file) and, next to it, an image with the same name and the extension `.pgm`: 0 is occupied,
/// 254 free, 205 unknown; the row with the largest y comes first. With the thresholds in the file, both `map_server`
/// and Nav2 restore all three states ("trinary"): `free_thresh` is 0.196, because with Nav2's default of 0.25, unknown
/// cells would be read as free. Each file is replaced atomically, the image first. Errors: write_failed,
/// invalid_argument (no file name, or one that ends in .pgm or contains a quotation mark, a backslash or a control
/// character; an empty map, or one whose origin or resolution is not finite; in these cases nothing is written).
ORBIS_LAZY [[nodiscard]] result<void> save_floor_map(const std::filesystem::path& path, const floor_map& map);

}  // namespace orbis::nav

#ifndef ORBIS_COMPILED
#include <orbis/nav/floor_file-inl.hpp>
#endif

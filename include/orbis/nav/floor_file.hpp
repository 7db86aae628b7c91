// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Floor maps as files that the map servers of ROS and Nav2 read.
#pragma once

#include <filesystem>

#include <orbis/core/result.hpp>
#include <orbis/nav/floor_map.hpp>

namespace orbis::nav {

/// Writes `path` (a `.yaml` file) and next to it an image of the same name that ends in `.pgm`: 0 is occupied, 254
/// free, 205 unknown, the row of the largest y first. With the thresholds in the file, both `map_server` and Nav2 read
/// all three states back ("trinary"): `free_thresh` is 0.196, because with 0.25, Nav2's default, unknown cells are read
/// as free. Each file is replaced atomically, the image first. Errors: write_failed, invalid_argument (no file name, or
/// one that ends in .pgm or contains a quotation mark, a backslash or a control character; an empty map, or one whose
/// origin or resolution is not finite; in these cases nothing is written).
[[nodiscard]] result<void> save_floor_map(const std::filesystem::path& path, const floor_map& map);

}  // namespace orbis::nav

#ifndef ORBIS_COMPILED
#include <orbis/nav/floor_file-inl.hpp>
#endif

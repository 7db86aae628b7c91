// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Floor maps as files that the map servers of ROS and Nav2 read.
#pragma once

#include <filesystem>

#include <orbis/core/result.hpp>
#include <orbis/nav/floor_map.hpp>

namespace orbis::nav {

/// Writes `path` (a `.yaml` file) and beside it an image of the same name that ends in `.pgm`: 0 is occupied, 254 free,
/// 205 unknown, the row of the largest y first. The thresholds are those with which both `map_server` and Nav2 read all
/// three back ("trinary"): `free_thresh` is 0.196, for with 0.25, which Nav2 writes by default, unknown cells are read
/// as free. Each file is replaced at once, the image first. Errors: write_failed, invalid_argument (no name, or one
/// that ends in .pgm, or has a quotation mark, a backslash or a control character in it; an empty map, or one whose
/// origin or resolution is not finite; nothing is written then).
[[nodiscard]] result<void> save_floor_map(const std::filesystem::path& path, const floor_map& map);

}  // namespace orbis::nav

#ifndef ORBIS_COMPILED
#include <orbis/nav/floor_file-inl.hpp>
#endif

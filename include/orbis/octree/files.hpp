// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Reading and writing of OctoMap's files: `.bt` (free or occupied, 2 bits per child) and `.ot` (log-odds as float32).
///
/// The files are byte-identical to those of OctoMap for the same map, including the pruning. Reading takes at most 8 KB
/// plus 400 bytes of memory per byte of the file, even for damaged files. The library orbis::compiled contains these
/// functions for maps with the model log_odds<>; for other models include files-inl.hpp.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include <orbis/core/result.hpp>
#include <orbis/octree/occupancy_octree.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::octree {

/// Returns the bytes of a `.bt` file: every known voxel is free or occupied, whichever is more likely, and the tree is
/// pruned.
/// @pre map.tree_depth() == default_tree_depth
template <octomap_model Model>
[[nodiscard]] std::string bt_bytes(const occupancy_octree<Model>& map);

/// Returns the bytes of an `.ot` file: the pruned octree with all its log-odds.
/// @pre map.tree_depth() == default_tree_depth
template <octomap_model Model>
[[nodiscard]] std::string ot_bytes(const occupancy_octree<Model>& map);

/// Writes a `.bt` file atomically. Errors: write_failed; unsupported if the tree depth of the map differs from
/// OctoMap's.
template <octomap_model Model>
[[nodiscard]] result<void> write_bt(const occupancy_octree<Model>& map, const std::filesystem::path& path);

/// Writes an `.ot` file atomically. Errors: those of write_bt.
template <octomap_model Model>
[[nodiscard]] result<void> write_ot(const occupancy_octree<Model>& map, const std::filesystem::path& path);

/// Reads the bytes of a `.bt` file; `where` names the source in error messages. Leaves get the log-odds at the model's
/// bounds. Errors: malformed (damaged, truncated, not a `.bt` file), unsupported (another type of tree).
template <octomap_model Model = log_odds<>>
[[nodiscard]] result<occupancy_octree<Model>> read_bt(std::span<const std::byte> bytes,
                                                      const std::string& where = "bytes");

/// Reads the bytes of an `.ot` file. Skips the values of inner nodes, which follow from the leaves.
template <octomap_model Model = log_odds<>>
[[nodiscard]] result<occupancy_octree<Model>> read_ot(std::span<const std::byte> bytes,
                                                      const std::string& where = "bytes");

/// Reads a file. Errors: not_found, unreadable, and those of the functions above.
template <octomap_model Model = log_odds<>>
[[nodiscard]] result<occupancy_octree<Model>> read_bt(const std::filesystem::path& path);
template <octomap_model Model = log_odds<>>
[[nodiscard]] result<occupancy_octree<Model>> read_ot(const std::filesystem::path& path);

}  // namespace orbis::octree

#ifndef ORBIS_COMPILED
#include <orbis/octree/files-inl.hpp>
#endif

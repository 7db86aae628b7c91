// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Trajectories in the text format of the TUM RGB-D benchmark: `timestamp tx ty tz qx qy qz qw`, seconds and metres,
/// one pose `T_world_camera` per line, `#` for comments.
#pragma once

#include <filesystem>
#include <string_view>

#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>

namespace orbis::io {

/// The poses in `text`, sorted by time (stably). `where` names the source in errors; quaternions of
/// any positive norm are normalised. Text without poses gives an empty trajectory.
/// Errors: malformed, with the line (not 8 numbers, NaN or infinity, a zero quaternion).
[[nodiscard]] result<trajectory> parse_trajectory(std::string_view text, const std::filesystem::path& where = {});

/// Reads a trajectory file; see `parse_trajectory`. Errors: not_found, unreadable, malformed.
[[nodiscard]] result<trajectory> read_trajectory(const std::filesystem::path& path);

/// Writes a trajectory file atomically: 9 decimals for the time, 9 significant digits for the rest. Errors:
/// write_failed.
result<void> write_trajectory(const std::filesystem::path& path, const trajectory& poses);

}  // namespace orbis::io

#ifndef ORBIS_COMPILED
#include <orbis/io/trajectory_file-inl.hpp>
#endif

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Trajectories in the text format of the TUM RGB-D benchmark: `timestamp tx ty tz qx qy qz qw`, seconds and metres,
/// one pose `T_world_camera` per line, `#` for comments. `read_trajectory_file` also reads those of EuRoC and KITTI.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/io/trajectory_reading.hpp>

namespace orbis::io {

/// The poses in `text`, sorted by time (stably). `where` names the source in errors; quaternions of
/// any positive norm are normalised. Text without poses gives an empty trajectory.
/// Errors: malformed, with the line (not 8 numbers, NaN or infinity, a zero quaternion).
[[nodiscard]] result<trajectory> parse_trajectory(std::string_view text, const std::filesystem::path& where = {});

/// Reads a trajectory file; see `parse_trajectory`. Errors: not_found, unreadable, malformed.
[[nodiscard]] result<trajectory> read_trajectory(const std::filesystem::path& path);

/// Parses a trajectory in the layout of its first lines: EuRoC (the header names the quaternion with w first or, if it
/// names none, commas separate times of 19 digits), KITTI (12 numbers) or TUM. Fields are separated by blanks, commas
/// or semicolons. Accepts `#` comments and a line of names before the poses; if it names time, position and quaternion,
/// other columns may precede them. Times are in seconds, or in the unit of the first one: nanoseconds if the header
/// says so and it is a whole number, otherwise by its digits (13: milliseconds, 16: microseconds, 19: nanoseconds).
/// Poses with NaN, infinity, or a zero quaternion or rotation are lost ones. Of poses with equal times the first one is
/// kept; of several runs, only the first one if a later one has other poses during its time. Notes report all of this.
/// Errors: malformed, with the line (too few numbers, a quaternion that is too large or almost zero); unsupported (a
/// header that names the quaternion before the position, or in another order); degenerate (a quarter of the poses have
/// the time of another pose and differ from it; with several runs, a quarter of those of the first one or more than
/// half of all). O(n log n).
[[nodiscard]] result<trajectory_reading> parse_trajectory_file(std::string_view text,
                                                               const std::filesystem::path& where = {});

/// Reads a trajectory file; see `parse_trajectory_file`. Errors: not_found, unreadable, malformed, unsupported,
/// degenerate.
[[nodiscard]] result<trajectory_reading> read_trajectory_file(const std::filesystem::path& path);

/// Sets the times of a trajectory in KITTI's layout from a file with one time per line, ascending. Errors: not_found,
/// unreadable, malformed (with the line; another number of times than of poses).
[[nodiscard]] result<void> set_times(trajectory_reading& read, const std::filesystem::path& times);

/// Time spans of two trajectories for a message: "1403715529 to 1403715531.5 s and 0 to 2 s", with `describe_units`.
[[nodiscard]] std::string describe_spans(const trajectory& a, const trajectory& b);

/// The unit that the times of one of two trajectories seem to have, if this would make their spans agree: "those of the
/// first seem to be milliseconds"; otherwise empty.
[[nodiscard]] std::string describe_units(const trajectory& a, const trajectory& b);

/// Writes a trajectory file atomically: 9 decimals for the time, 9 significant digits for the rest. Errors:
/// write_failed.
result<void> write_trajectory(const std::filesystem::path& path, const trajectory& poses);

}  // namespace orbis::io

#ifndef ORBIS_COMPILED
#include <orbis/io/trajectory_file-inl.hpp>
#endif

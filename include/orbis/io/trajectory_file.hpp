// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Trajectories in the text format of the TUM RGB-D benchmark: `timestamp tx ty tz qx qy qz qw`, seconds and metres,
/// one pose `T_world_camera` per line, `#` for comments. `read_trajectory_file` also reads the EuRoC and KITTI layouts.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <orbis/core/inline.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/io/trajectory_reading.hpp>

namespace orbis::io {

/// The poses in `text`, stably sorted by time. `where` names the source in errors; quaternions of any positive norm are
/// normalised. Text without poses gives an empty trajectory. Errors: malformed, with the line number (not 8 numbers,
/// NaN or infinity, a zero quaternion).
ORBIS_LAZY [[nodiscard]] result<trajectory> parse_trajectory(std::string_view text,
                                                             const std::filesystem::path& where = {});

/// Reads a trajectory file; see `parse_trajectory`. Errors: not_found, unreadable, malformed.
ORBIS_LAZY [[nodiscard]] result<trajectory> read_trajectory(const std::filesystem::path& path);

/// Parses a trajectory; its first lines determine the layout: EuRoC (the header lists the quaternion with w first, or
/// lists no quaternion while fields are separated by commas and times have 19 digits), KITTI (12 numbers) or TUM.
/// Fields are separated by blanks, commas or semicolons. Accepts `#` comments and a line of column names before the
/// poses; if it contains time, position and quaternion, other columns may precede them. The unit of time is
/// nanoseconds if the header specifies them and the first time stamp is a whole number; otherwise the number of digits
/// of the first time stamp determines it (13: milliseconds, 16: microseconds, 19: nanoseconds, else seconds). Poses
/// with NaN, infinity, or a zero quaternion or rotation count as lost. Of poses with equal times, the first one is
/// kept; if a later run in the file has other poses during the time of the first run, only the first run is kept. Notes
/// report all of this. Errors: malformed, with the line number (too few numbers, a quaternion that is too large or
/// almost zero); unsupported (a header that lists the quaternion before the position, or in another order); degenerate
/// (at least a quarter of the poses have the time of another pose and differ from it; with several runs, at least a
/// quarter of the poses of the first run or more than half of all poses). O(n log n).
ORBIS_LAZY [[nodiscard]] result<trajectory_reading> parse_trajectory_file(std::string_view text,
                                                                          const std::filesystem::path& where = {});

/// Reads a trajectory file; see `parse_trajectory_file`. Errors: not_found, unreadable, malformed, unsupported,
/// degenerate.
ORBIS_LAZY [[nodiscard]] result<trajectory_reading> read_trajectory_file(const std::filesystem::path& path);

/// Sets the times of a trajectory in KITTI's layout from a file with ascending times, one per line. Errors: not_found,
/// unreadable, malformed (an invalid line, with its number, or different numbers of times and poses).
ORBIS_LAZY [[nodiscard]] result<void> set_times(trajectory_reading& read, const std::filesystem::path& times);

/// Time spans of two trajectories for a message: "1403715529 to 1403715531.5 s and 0 to 2 s", followed by the result of
/// `describe_units`.
ORBIS_LAZY [[nodiscard]] std::string describe_spans(const trajectory& a, const trajectory& b);

/// An explanation for two trajectories whose time spans agree only if the times of one are in another unit: "the times
/// of the first seem to be in milliseconds". Empty for all other trajectories.
ORBIS_LAZY [[nodiscard]] std::string describe_units(const trajectory& a, const trajectory& b);

/// Writes a trajectory file atomically: 9 decimals for the time, 9 significant digits for the rest. Errors:
/// write_failed.
ORBIS_LAZY result<void> write_trajectory(const std::filesystem::path& path, const trajectory& poses);

}  // namespace orbis::io

#ifndef ORBIS_COMPILED
#include <orbis/io/trajectory_file-inl.hpp>
#endif

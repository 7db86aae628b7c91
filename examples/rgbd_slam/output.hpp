// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Files and console output at the end of a run.
#pragma once

#include <orbis/core/result.hpp>

#include "console.hpp"
#include "result_files.hpp"
#include "results.hpp"
#include "settings.hpp"
#include "source.hpp"

namespace app {

/// Creates the results, with a description of input and settings for the report. Files are created in `folder`.
[[nodiscard]] results begin_results(const settings& s, const std::string& title, const frame_source* source,
                                    const std::filesystem::path& folder);

/// Writes trajectory.txt and keyframes.txt.
[[nodiscard]] orbis::result<void> write_trajectories(const slam_results& slam, const std::filesystem::path& folder);
/// Writes camera_used.toml: the camera that the run used, and its shutter, as given or as estimated at the end.
[[nodiscard]] orbis::result<void> write_camera_used(const frame_source& source, const shutter_results& shutter,
                                                    const std::filesystem::path& folder);
/// Writes pictures, report.html and summary.json.
[[nodiscard]] orbis::result<void> write_report_files(results& r, const orbis::trajectory& cameras,
                                                     const file_lists& files, console& console);
/// Writes summary.json only.
[[nodiscard]] orbis::result<void> write_summary_only(results& r, const file_lists& files, console& console);
/// The error of a run in which no frame could start tracking.
[[nodiscard]] orbis::error explain_no_start(const results& r, const settings& s);
/// Ends a run in which no frame was tracked: writes summary.json, prints `why`, and returns `code` (or bad_input if
/// writing fails).
[[nodiscard]] exit_code report_no_start(results& r, const orbis::error& why, exit_code code, result_files& files,
                                        console& console);
/// Prints the tables of results and the path of the report.
void print_results(const results& r, console& console);

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a run writes and prints in its end.
#pragma once

#include <orbis/core/result.hpp>

#include "console.hpp"
#include "result_files.hpp"
#include "results.hpp"
#include "settings.hpp"
#include "source.hpp"

namespace app {

/// What was asked for, in words, for the report. Files are made in `folder`.
[[nodiscard]] results begin_results(const settings& s, const std::string& title, const frame_source* source,
                                    const std::filesystem::path& folder);

/// Writes trajectory.txt and keyframes.txt.
[[nodiscard]] orbis::result<void> write_trajectories(const slam_results& slam, const std::filesystem::path& folder);
/// Writes camera_used.toml: the camera and its shutter as the run found them to be.
[[nodiscard]] orbis::result<void> write_camera_used(const frame_source& source, const shutter_results& shutter,
                                                    const std::filesystem::path& folder);
/// Writes pictures, report.html and summary.json, and puts all files in place.
[[nodiscard]] orbis::result<void> write_report_files(results& r, const orbis::trajectory& cameras, result_files& files,
                                                     console& console);
/// That no frame had what it takes.
[[nodiscard]] orbis::error explain_no_start(const results& r, const settings& s);
/// Where not a single frame was tracked: summary.json, `why` as a line on stderr, and the code for it.
[[nodiscard]] exit_code report_no_start(results& r, const orbis::error& why, exit_code code, result_files& files,
                                        console& console);
/// The tables, and where the files are, on the terminal.
void print_results(const results& r, console& console);

}  // namespace app

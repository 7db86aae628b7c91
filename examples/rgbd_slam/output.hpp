// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The folder that everything goes into.
#pragma once

#include <orbis/core/result.hpp>

#include "console.hpp"
#include "results.hpp"
#include "settings.hpp"
#include "source.hpp"

namespace app {

/// Makes the folders of what will be written and sees whether files can be made in them, before any work is done.
[[nodiscard]] orbis::result<void> prepare_output(const settings& s);
/// Takes away what an earlier run left there, so that no file contradicts another.
void remove_old_results(const std::filesystem::path& out);

/// What was asked for, in words, for the report.
[[nodiscard]] results begin_results(const settings& s, const std::string& title, const frame_source* source);

/// Writes trajectory.txt and keyframes.txt.
[[nodiscard]] orbis::result<void> write_trajectories(const slam_results& slam, const std::filesystem::path& out);
/// Writes pictures, report.html and summary.json.
[[nodiscard]] orbis::result<void> write_report_files(results& r, const orbis::trajectory& cameras, console& say);
/// That no frame had what it takes.
[[nodiscard]] orbis::error explain_no_start(const results& r, const settings& s);
/// Where not a single frame was tracked: summary.json, `why` as a line on stderr, and the code for it.
[[nodiscard]] exit_code report_no_start(results& r, const orbis::error& why, console& say);
/// The tables, and where the files are, on the terminal.
void print_results(const results& r, console& say);

}  // namespace app

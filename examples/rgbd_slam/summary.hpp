// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Writes summary.json, and formats the tables for the terminal.
#pragma once

#include <string>
#include <vector>

#include <orbis/core/result.hpp>

#include "../common/count_text.hpp"
#include "results.hpp"

namespace app {

/// The summary as JSON text; missing values are null.
[[nodiscard]] std::string summary_json(const results& r);
/// The comparison with ground truth and the warnings as JSON text, for `eval --json`.
[[nodiscard]] std::string accuracy_json(const accuracy& a, const std::vector<std::string>& warnings);
[[nodiscard]] orbis::result<void> write_summary(const results& r);

/// A table with the sizes of the point cloud and the octree before and after the filter.
[[nodiscard]] std::string size_table(const map_results& m);
/// The axes of the world frame and how they were found.
[[nodiscard]] std::string world_text(const world_results& w);
/// The number and share of removed points: "123 of 4,567 points (2.69 %)".
[[nodiscard]] std::string removed_text(const map_results& m);
/// The chosen filter, the number of removed points, and the reason for the choice.
[[nodiscard]] std::string filter_lines(const map_results& m);
/// Lines that describe the floor and the planned path.
[[nodiscard]] std::string navigation_lines(const navigation_results& n);
[[nodiscard]] std::string floor_text(const navigation_results& n);
/// The shape and radius of the robot for which the path is planned: "ball of 0.2 m".
[[nodiscard]] std::string robot_text(const navigation_results& n);
[[nodiscard]] std::string path_text(const navigation_results& n);
[[nodiscard]] std::string accuracy_lines(const accuracy& a);

/// Formats a size: "12.3 MB".
[[nodiscard]] std::string bytes_text(std::uintmax_t bytes);
using examples::count_text;

}  // namespace app

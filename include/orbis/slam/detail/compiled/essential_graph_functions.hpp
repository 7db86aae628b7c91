// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The optimisation of an essential graph: inline, or, with ORBIS_COMPILED, compiled once, by
/// cmake/compiled/slam_essential_graph.cpp.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <orbis/core/compiled_once.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/optimize/pose_graph.hpp>
#include <orbis/slam/detail/loops/essential_graph.hpp>

namespace orbis::slam::detail {

ORBIS_COMPILED_ONCE std::optional<int> optimize_poses(std::span<se3> poses, const std::vector<essential_edge>& edges,
                                                      std::span<const std::uint8_t> is_fixed, int max_iterations,
                                                      const progress& callback) {
  optimize::pose_graph_solver<se3> solver;
  const auto summary = solver.solve(seq, poses, edges, {.max_iterations = max_iterations, .fixed = is_fixed}, callback);
  if (optimize::is_failure(summary.status) || summary.status == optimize::pose_graph_status::cancelled)
    return std::nullopt;
  return summary.iterations;
}

}  // namespace orbis::slam::detail

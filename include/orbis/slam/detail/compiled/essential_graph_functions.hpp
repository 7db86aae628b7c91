// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The optimisation of an essential graph: inline, or, with ORBIS_COMPILED, compiled once, by
/// cmake/compiled/slam_essential_graph.cpp.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <orbis/core/compiled_once.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/pose_graph.hpp>
#include <orbis/optimize/pose_graph_problem.hpp>
#include <orbis/slam/detail/loops/essential_graph.hpp>

namespace orbis::slam::detail {

/// Optimises poses of type `T`. Their number is that of the vertices.
template <class T>
[[nodiscard]] std::optional<int> optimize_graph(std::span<T> poses, const std::vector<essential_edge>& edges,
                                                std::span<const std::uint8_t> is_fixed, int max_iterations,
                                                const progress& callback) {
  using square = matrix<T::dof, T::dof>;
  std::vector<optimize::pose_graph_edge<T>> measured;
  measured.reserve(edges.size());
  for (const essential_edge& e : edges) {
    const sim3& m = e.measurement;
    if constexpr (std::same_as<T, se3>)
      measured.push_back({e.from, e.to, se3(m.rotation(), m.translation()), square(e.weight * identity<square>())});
    else
      measured.push_back({e.from, e.to, m, square(e.weight * identity<square>())});
  }
  optimize::pose_graph_solver<T> solver;
  const auto summary =
      solver.solve(seq, poses, measured, {.max_iterations = max_iterations, .fixed = is_fixed}, callback);
  if (optimize::is_failure(summary.status) || summary.status == optimize::pose_graph_status::cancelled)
    return std::nullopt;
  return summary.iterations;
}

ORBIS_COMPILED_ONCE std::optional<int> optimize_poses(std::span<sim3> poses, const std::vector<essential_edge>& edges,
                                                      std::span<const std::uint8_t> is_fixed, bool scale_is_known,
                                                      int max_iterations, const progress& callback) {
  if (!scale_is_known) return optimize_graph<sim3>(poses, edges, is_fixed, max_iterations, callback);
  std::vector<se3> rigid;
  rigid.reserve(poses.size());
  for (const sim3& p : poses) rigid.emplace_back(p.rotation(), p.translation());
  const auto iterations = optimize_graph<se3>(rigid, edges, is_fixed, max_iterations, callback);
  for (std::size_t i = 0; i != poses.size(); ++i) poses[i] = sim3(rigid[i]);
  return iterations;
}

}  // namespace orbis::slam::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the library orbis::compiled holds of pose_graph.hpp: the default solver of graphs of poses.
#pragma once

#include <span>

#include <orbis/core/execution.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/optimize/detail/compiled/block_solvers.hpp>
#include <orbis/optimize/pose_graph.hpp>

namespace orbis::optimize {

ORBIS_INSTANTIATE_OPTIMIZE detail::pose_graph_equations<se3, trivial, quaternion_between>::pose_graph_equations(
    const trivial&, const quaternion_between&);
#define ORBIS_INSTANTIATE_POSE_GRAPH(policy)                                                           \
  ORBIS_INSTANTIATE_OPTIMIZE pose_graph_summary pose_graph_solver<se3>::solve_edges(                   \
      const policy&, std::span<se3>, std::span<const pose_graph_edge<se3>>, const pose_graph_options&, \
      const progress&, detail::no_report&);
ORBIS_INSTANTIATE_POSE_GRAPH(sequential_policy)
ORBIS_INSTANTIATE_POSE_GRAPH(parallel_policy)
#undef ORBIS_INSTANTIATE_POSE_GRAPH

}  // namespace orbis::optimize

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions of pose_graph.hpp.
#pragma once

#include <span>

#include <orbis/core/execution.hpp>
#include <orbis/optimize/detail/pose/pose_graph_descent.hpp>
#include <orbis/optimize/pose_graph.hpp>
#include <orbis/optimize/pose_graph_problem.hpp>
#include <orbis/optimize/robust_loss.hpp>
#include <orbis/optimize/solver_policies-inl.hpp>

namespace orbis::optimize {

template <class T, robust_loss Loss, general_damping_policy Damping, between_factor<T> Between>
pose_graph_solver<T, Loss, Damping, Between>::pose_graph_solver(Loss loss, Damping damping, Between between)
    : descent_{detail::pose_graph_descent<T, Loss, Damping, Between>{loss, damping, between}} {}

template <class T, robust_loss Loss, general_damping_policy Damping, between_factor<T> Between>
template <class Policy, class Edge, class Report>
pose_graph_summary pose_graph_solver<T, Loss, Damping, Between>::solve_edges(const Policy& policy,
                                                                             std::span<T> vertices,
                                                                             std::span<const Edge> edges,
                                                                             const pose_graph_options& options,
                                                                             const progress& callback, Report& report) {
  return descent_->solve(policy, vertices, edges, options, callback, report);
}

}  // namespace orbis::optimize

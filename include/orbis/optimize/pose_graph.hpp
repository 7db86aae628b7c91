// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Pose graph optimisation: estimates the poses that best agree with measured relative poses.
///
/// Sources: F. Lu, E. Milios, "Globally consistent range scan alignment for environment mapping", Autonomous Robots 4,
/// 1997; G. Grisetti, R. Kuemmerle, C. Stachniss, W. Burgard, "A tutorial on graph-based SLAM", IEEE ITS Magazine 2(4),
/// 2010.
#pragma once

#include <concepts>
#include <ranges>
#include <span>
#include <type_traits>

#include <orbis/core/execution.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/optimize/detail/boxed.hpp>
#include <orbis/optimize/detail/stage_watch.hpp>
#include <orbis/optimize/pose_graph_problem.hpp>
#include <orbis/optimize/robust_loss.hpp>
#include <orbis/optimize/solver_policies.hpp>

namespace orbis::optimize {

/// The default residual for graphs of `T`. For `se3`, it is the residual of g2o.
template <class T>
using default_between_t = std::conditional_t<std::same_as<T, se3>, quaternion_between, logarithm_between<T>>;

namespace detail {
template <class T, class Loss, class Damping, class Between>
class pose_graph_descent;
}  // namespace detail

/// Solver for pose graphs with vertices of type T (`se3`, `sim3`, `so3`), with a robust loss, a damping policy and a
/// residual, for example `pose_graph_solver<se3, huber, levenberg_marquardt> solver{huber{1.0}}`. Memory is reused:
/// solving a graph with the same edges again allocates nothing (with `orbis::seq`). Not thread-safe.
///
/// The library orbis::compiled contains it for `se3` and `sim3` graphs with the default policies and `pose_graph_edge`,
/// without a report; for other arguments include pose_graph-inl.hpp.
template <class T, robust_loss Loss = trivial, damping_policy Damping = dogleg,
          between_factor<T> Between = default_between_t<T>>
class pose_graph_solver {
 public:
  explicit pose_graph_solver(Loss loss = {}, Damping damping = {}, Between between = {});

  /// Minimises half the sum of the robust loss over the edges by moving `vertices`. The final cost is never higher than
  /// the initial one, and the vertices are unchanged if the status is a failure. Vertices without edges do not move,
  /// and the others move only in directions that the edges determine. If the edges leave a direction undetermined,
  /// `gauss_newton` stops with `singular`. Every execution policy gives the same result. One step takes O(blocks of the
  /// factor).
  ///
  /// `callback(iteration, max_iterations)` is called before each step and returns false to stop. `report(summary)` is
  /// called before the first step and after each one.
  /// @pre `options.fixed` is empty or has one entry per vertex
  template <execution_policy Policy, std::ranges::contiguous_range Edges, class Report = detail::no_report>
  requires relative_measurement<std::ranges::range_value_t<Edges>, T> pose_graph_summary
  solve(const Policy& policy, std::span<T> vertices, const Edges& edges, const pose_graph_options& options = {},
        progress callback = {}, Report&& report = {}) {
    const std::span<const std::ranges::range_value_t<Edges>> all{std::ranges::data(edges), std::ranges::size(edges)};
    return solve_edges(policy, vertices, all, options, callback, report);
  }

 private:
  template <class Policy, class Edge, class Report>
  pose_graph_summary solve_edges(const Policy& policy, std::span<T> vertices, std::span<const Edge> edges,
                                 const pose_graph_options& options, const progress& callback, Report& report);

  detail::boxed<detail::pose_graph_descent<T, Loss, Damping, Between>> descent_;
};

}  // namespace orbis::optimize

#ifndef ORBIS_COMPILED
#include <orbis/optimize/pose_graph-inl.hpp>
#endif

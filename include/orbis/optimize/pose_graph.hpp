// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Pose graph optimisation: the poses that agree best with measured relative poses.
///
/// Sources: F. Lu, E. Milios, "Globally consistent range scan alignment for environment mapping", Autonomous Robots 4,
/// 1997; G. Grisetti, R. Kuemmerle, C. Stachniss, W. Burgard, "A tutorial on graph-based SLAM", IEEE ITS Magazine 2(4),
/// 2010.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <ranges>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/pose/pose_graph_equations.hpp>
#include <orbis/optimize/detail/stage_watch.hpp>
#include <orbis/optimize/pose_graph_problem.hpp>
#include <orbis/optimize/robust_loss.hpp>
#include <orbis/optimize/solver_policies.hpp>

namespace orbis::optimize {

/// The residual that graphs of `T` are solved with by default. For `se3` it is that of g2o.
template <class T>
struct default_between {
  using type = logarithm_between<T>;
};
template <>
struct default_between<se3> {
  using type = quaternion_between;
};
template <class T>
using default_between_t = typename default_between<T>::type;

/// Solver of pose graphs with vertices of type T (`se3`, `sim3`, `so3`), made of a robust loss, a damping policy and a
/// residual, for example `pose_graph_solver<se3, huber, levenberg_marquardt> solver{huber{1.0}}`. Keeps its memory:
/// solving a graph with the same edges again allocates nothing (with `orbis::seq`). Not thread-safe.
template <class T, robust_loss Loss = trivial, general_damping_policy Damping = dogleg,
          between_factor<T> Between = default_between_t<T>>
class pose_graph_solver {
 public:
  explicit pose_graph_solver(Loss loss = {}, Damping damping = {}, Between between = {})
      : equations_{loss, between}, damping_{damping} {}

  /// Moves `vertices` so that half the sum of the robust loss over the edges falls. The vertices are never left with a
  /// higher cost than they had, and are unchanged if the status is a failure. Vertices without edges stay; so do
  /// directions that the edges do not determine, except with `gauss_newton`, which stops there with `singular`. Every
  /// execution policy gives the same result. One step costs O(blocks of the factor).
  ///
  /// `callback(iteration, max_iterations)` is asked before each step whether to go on. `report(summary)` is called
  /// before the first step and after each one.
  /// @pre `options.fixed` is empty or has one entry for each vertex
  template <execution_policy Policy, std::ranges::contiguous_range Edges, class Report = detail::no_report>
  requires relative_measurement<std::ranges::range_value_t<Edges>, T> pose_graph_summary
  solve(const Policy& policy, std::span<T> vertices, const Edges& edges, const pose_graph_options& options = {},
        progress callback = {}, Report&& report = {}) {
    const std::span<const std::ranges::range_value_t<Edges>> all{std::ranges::data(edges), std::ranges::size(edges)};
    return solve_edges(policy, vertices, all, options, callback, report);
  }

 private:
  using equations_type = detail::pose_graph_equations<T, Loss, Between>;

  /// The graph as the damping policies see it.
  template <class Policy, class Edges>
  struct problem {
    equations_type& equations;
    const Policy& policy;
    Edges edges;
    pose_graph_summary& summary;

    void linearize() {
      const detail::stage_watch watch{summary.seconds.linearize};
      equations.linearize(policy, edges);
    }
    [[nodiscard]] double cost() const { return equations.cost(); }
    [[nodiscard]] const Eigen::VectorXd& gradient() const { return equations.gradient(); }
    [[nodiscard]] const Eigen::VectorXd& diagonal() const { return equations.diagonal(); }
    [[nodiscard]] double curvature(const Eigen::VectorXd& x) const { return equations.curvature(x); }
    [[nodiscard]] bool factor(const Eigen::VectorXd& damping) {
      const detail::stage_watch watch{summary.seconds.factor};
      ++summary.factorizations;
      return equations.factor(damping);
    }
    void solve(Eigen::VectorXd& x) {
      const detail::stage_watch watch{summary.seconds.solve};
      equations.solve(x);
    }
    [[nodiscard]] double try_step(const Eigen::VectorXd& step) {
      const detail::stage_watch watch{summary.seconds.evaluate};
      return equations.try_step(policy, edges, step);
    }
  };

  template <class Policy, class Edge, class Report>
  pose_graph_summary solve_edges(const Policy& policy, std::span<T> vertices, std::span<const Edge> edges,
                                 const pose_graph_options& options, const progress& callback, Report& report);

  template <class Edges>
  [[nodiscard]] bool set_up(std::span<const T> vertices, const Edges& edges, const pose_graph_options& options,
                            pose_graph_summary& summary) {
    assert(options.fixed.empty() || options.fixed.size() == vertices.size());
    const detail::stage_watch watch{summary.seconds.set_up};
    auto finding = detail::check_pose_graph<Between::dimension>(vertices, edges, options.semidefinite_information);
    if (!is_failure(finding.status)) finding = equations_.begin(vertices, edges, options);
    summary.where = finding.where;
    summary.status = finding.status;
    if (is_failure(finding.status)) return false;
    if (!equations_.structure().vertices.empty()) return true;
    summary.status = pose_graph_status::nothing_to_do;
    return false;
  }

  template <class Graph, class Report>
  [[nodiscard]] pose_graph_status run(Graph& graph, const pose_graph_options& options, const progress& callback,
                                      pose_graph_summary& summary, Report& report) {
    typename Damping::state state;
    const auto limit = static_cast<std::size_t>(std::max(0, options.max_iterations));
    for (std::size_t k = 0; k != limit; ++k) {
      if (!callback(k, limit)) return pose_graph_status::cancelled;
      switch (damping_.advance(state, graph, workspace_)) {
        case step_outcome::taken: break;
        case step_outcome::stationary: return pose_graph_status::converged;
        case step_outcome::exhausted: return pose_graph_status::no_progress;
        case step_outcome::singular: summary.where = equations_.failed_vertex(); return pose_graph_status::singular;
      }
      const double before = equations_.cost();
      equations_.accept();
      const double cost = equations_.cost();
      ++summary.iterations;
      if (cost <= summary.final_cost) {
        summary.final_cost = cost;
        best_ = equations_.estimate();
      }
      report(std::as_const(summary));
      if (std::abs(before - cost) <= options.relative_tolerance * before) return pose_graph_status::converged;
      if (k + 1 != limit) graph.linearize();
    }
    return pose_graph_status::iteration_limit;
  }

  equations_type equations_;
  Damping damping_;
  std::vector<T> best_;
  step_workspace workspace_;
};

template <class T, robust_loss Loss, general_damping_policy Damping, between_factor<T> Between>
template <class Policy, class Edge, class Report>
pose_graph_summary pose_graph_solver<T, Loss, Damping, Between>::solve_edges(const Policy& policy,
                                                                             std::span<T> vertices,
                                                                             std::span<const Edge> edges,
                                                                             const pose_graph_options& options,
                                                                             const progress& callback, Report& report) {
  pose_graph_summary summary;
  if (!set_up(std::span<const T>{vertices}, edges, options, summary)) return summary;
  problem<Policy, std::span<const Edge>> graph{equations_, policy, edges, summary};
  graph.linearize();
  summary.initial_cost = summary.final_cost = graph.cost();
  best_ = equations_.estimate();
  report(std::as_const(summary));
  summary.status = run(graph, options, callback, summary, report);
  for (const std::uint32_t v : equations_.structure().vertices) vertices[v] = best_[v];
  return summary;
}

/// Solves a pose graph once, with a solver that is made for it; see `pose_graph_solver::solve`.
template <execution_policy Policy, std::ranges::contiguous_range Vertices, std::ranges::contiguous_range Edges,
          robust_loss Loss = trivial, general_damping_policy Damping = dogleg>
pose_graph_summary solve_pose_graph(const Policy& policy, Vertices&& vertices, const Edges& edges,
                                    const pose_graph_options& options = {}, progress callback = {},
                                    const Loss& loss = {}, const Damping& damping = {}) {
  using pose = std::ranges::range_value_t<Vertices>;
  pose_graph_solver<pose, Loss, Damping> solver{loss, damping};
  return solver.solve(policy, std::span<pose>{std::ranges::data(vertices), std::ranges::size(vertices)}, edges, options,
                      callback);
}

}  // namespace orbis::optimize

#ifdef ORBIS_COMPILED
#include <orbis/optimize/detail/compiled/pose_graph.hpp>
#endif

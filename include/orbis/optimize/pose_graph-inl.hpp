// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of pose_graph.hpp.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <orbis/optimize/detail/pose/pose_graph_equations.hpp>
#include <orbis/optimize/pose_graph.hpp>

namespace orbis::optimize {
namespace detail {

template <class T, class Loss, class Damping, class Between>
class pose_graph_descent {
 public:
  pose_graph_descent(const Loss& loss, const Damping& damping, const Between& between)
      : equations_{loss, between}, damping_{damping} {}

  template <class Policy, class Edge, class Report>
  pose_graph_summary solve(const Policy& policy, std::span<T> vertices, std::span<const Edge> edges,
                           const pose_graph_options& options, const progress& callback, Report& report) {
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

 private:
  using equations_type = pose_graph_equations<T, Loss, Between>;

  /// The interface through which damping policies access the graph.
  template <class Policy, class Edges>
  struct problem {
    equations_type& equations;
    const Policy& policy;
    Edges edges;
    pose_graph_summary& summary;

    void linearize() {
      const stage_watch watch{summary.seconds.linearize};
      equations.linearize(policy, edges);
    }
    [[nodiscard]] double cost() const { return equations.cost(); }
    [[nodiscard]] const Eigen::VectorXd& gradient() const { return equations.gradient(); }
    [[nodiscard]] const Eigen::VectorXd& diagonal() const { return equations.diagonal(); }
    [[nodiscard]] double curvature(const Eigen::VectorXd& x) const { return equations.curvature(x); }
    [[nodiscard]] bool factor(const Eigen::VectorXd& damping) {
      const stage_watch watch{summary.seconds.factor};
      ++summary.factorizations;
      return equations.factor(damping);
    }
    void newton_step(Eigen::VectorXd& out) {
      const stage_watch watch{summary.seconds.solve};
      const Eigen::VectorXd& g = gradient();
      set_each(out, g.size(), [&](Eigen::Index i) { return -g[i]; });
      equations.solve(out);
    }
    [[nodiscard]] double try_step(const Eigen::VectorXd& step) {
      const stage_watch watch{summary.seconds.evaluate};
      return equations.try_step(policy, edges, step);
    }
  };

  template <class Edges>
  [[nodiscard]] bool set_up(std::span<const T> vertices, const Edges& edges, const pose_graph_options& options,
                            pose_graph_summary& summary) {
    assert(options.fixed.empty() || options.fixed.size() == vertices.size());
    const stage_watch watch{summary.seconds.set_up};
    auto finding = check_pose_graph<Between::dimension>(vertices, edges, options.semidefinite_information);
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

}  // namespace detail

template <class T, robust_loss Loss, damping_policy Damping, between_factor<T> Between>
pose_graph_solver<T, Loss, Damping, Between>::pose_graph_solver(Loss loss, Damping damping, Between between)
    : descent_{detail::pose_graph_descent<T, Loss, Damping, Between>{loss, damping, between}} {}

template <class T, robust_loss Loss, damping_policy Damping, between_factor<T> Between>
template <class Policy, class Edge, class Report>
pose_graph_summary pose_graph_solver<T, Loss, Damping, Between>::solve_edges(const Policy& policy,
                                                                             std::span<T> vertices,
                                                                             std::span<const Edge> edges,
                                                                             const pose_graph_options& options,
                                                                             const progress& callback, Report& report) {
  return descent_->solve(policy, vertices, edges, options, callback, report);
}

}  // namespace orbis::optimize

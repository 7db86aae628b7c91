// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Pose graphs: poses that agree best with measured relative poses between them.
///
/// Sources: F. Lu, E. Milios, "Globally consistent range scan alignment for environment mapping",
/// Autonomous Robots 4, 1997; G. Grisetti, R. Kuemmerle, C. Stachniss, W. Burgard, "A tutorial on
/// graph-based SLAM", IEEE ITS Magazine 2(4), 2010.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <ranges>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/progress.hpp>
#include <orbis/optimize/between_factor.hpp>
#include <orbis/optimize/damping.hpp>
#include <orbis/optimize/detail/bundle/stage_watch.hpp>
#include <orbis/optimize/detail/pose/pose_graph_structure.hpp>
#include <orbis/optimize/detail/sparse/block_cholesky.hpp>
#include <orbis/optimize/manifold.hpp>
#include <orbis/optimize/pose_graph_summary.hpp>
#include <orbis/optimize/robust_loss.hpp>

namespace orbis::optimize {

/// The residual by which graphs of `T` are solved unless another is asked for. For `se3` it is g2o's.
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

/// Made of a residual, a robust loss, a damping policy and a manifold, e.g.
/// `pose_graph_solver<se3, huber, levenberg_marquardt> solver{huber{1.0}}`. Keeps its memory: solving a graph with
/// the same edges again allocates nothing (with `orbis::seq`). Not for several threads at once.
template <class T, robust_loss Loss = trivial, general_damping_policy Damping = dogleg,
          between_factor<T> Between = default_between_t<T>, manifold Manifold = lie_group<T>>
requires std::same_as<typename Manifold::point, T>
class pose_graph_solver {
 public:
  explicit pose_graph_solver(Loss loss = {}, Damping damping = {}, Between between = {}, Manifold on = {})
      : loss_{loss}, damping_{damping}, between_{between}, manifold_{on} {}

  /// Moves `vertices` so that half the sum of the robust loss of the edges falls; never leaves them
  /// worse than they were, and untouched where the status is a failure of the input. Vertices without
  /// edges stay where they are; so do directions that the edges say nothing about, but for
  /// `gauss_newton`, which stops there with `singular`. The same result for every policy. One step is O(blocks of the
  /// factor).
  ///
  /// `report(summary)` is called before the first and after every step.
  /// @pre `options.fixed` is empty or has one entry for each vertex
  template <execution_policy Policy, std::ranges::contiguous_range Edges, class Report = detail::no_report>
  requires relative_measurement<std::ranges::range_value_t<Edges>, T> pose_graph_summary
  solve(const Policy& policy, std::span<T> vertices, const Edges& edges, const pose_graph_options& options = {},
        progress callback = {}, Report&& report = {}) {
    pose_graph_summary summary;
    const std::span all{std::ranges::data(edges), std::ranges::size(edges)};
    if (!set_up(std::span<const T>{vertices}, all, options, summary)) return summary;
    problem<Policy, std::remove_cvref_t<decltype(all)>> graph{*this, policy, all, summary};
    graph.linearize();
    summary.initial_cost = summary.final_cost = cost_;
    best_ = estimate_;
    report(std::as_const(summary));
    summary.status = run(graph, options, callback, summary, report);
    for (const std::uint32_t v : structure_.vertices) vertices[v] = best_[v];
    return summary;
  }

  /// The structure of the factor of the last graph.
  [[nodiscard]] const block_symbolic& symbolic() const { return cholesky_.symbolic(); }

 private:
  static constexpr int size = Manifold::dimension;
  using block = matrix<size, size>;
  using vector = matrix<size>;
  static constexpr std::size_t grain = 256;  ///< of loops over bundles and vertices

  /// What the edges of a bundle add to the normal equations.
  struct share {
    block from, to;
    vector gradient_from, gradient_to;
  };

  /// The graph as the damping policies see it.
  template <class Policy, class Edges>
  struct problem {
    pose_graph_solver& solver;
    const Policy& policy;
    Edges edges;
    pose_graph_summary& summary;

    void linearize() {
      const detail::stage_watch watch{summary.seconds.linearize};
      solver.linearize(policy, edges);
    }
    [[nodiscard]] double cost() const { return solver.cost_; }
    [[nodiscard]] const Eigen::VectorXd& gradient() const { return solver.gradient_; }
    [[nodiscard]] const Eigen::VectorXd& diagonal() const { return solver.diagonal_; }
    [[nodiscard]] double curvature(const Eigen::VectorXd& x) const { return solver.curvature(x); }
    [[nodiscard]] bool factor(const Eigen::VectorXd& damping) {
      const detail::stage_watch watch{summary.seconds.factor};
      ++summary.factorizations;
      return solver.cholesky_.factor(solver.on_diagonal_, solver.off_diagonal_,
                                     {damping.data(), static_cast<std::size_t>(damping.size())});
    }
    void solve(Eigen::VectorXd& x) {
      const detail::stage_watch watch{summary.seconds.solve};
      solver.cholesky_.solve({x.data(), static_cast<std::size_t>(x.size())});
    }
    [[nodiscard]] double try_step(const Eigen::VectorXd& step) {
      const detail::stage_watch watch{summary.seconds.evaluate};
      return solver.tried_cost_ = solver.evaluate(policy, edges, step);
    }
  };

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
        case step_outcome::singular:
          summary.where = structure_.vertices[cholesky_.failed_block()];
          return pose_graph_status::singular;
      }
      const double before = cost_;
      estimate_.swap(tried_);
      cost_ = tried_cost_;
      ++summary.iterations;
      if (cost_ <= summary.final_cost) {
        summary.final_cost = cost_;
        best_ = estimate_;
      }
      report(std::as_const(summary));
      if (std::abs(before - cost_) <= options.relative_tolerance * before) return pose_graph_status::converged;
      if (k + 1 != limit) graph.linearize();
    }
    return pose_graph_status::iteration_limit;
  }

  template <class Edges>
  [[nodiscard]] bool set_up(std::span<const T> vertices, const Edges& edges, const pose_graph_options& options,
                            pose_graph_summary& summary) {
    assert(options.fixed.empty() || options.fixed.size() == vertices.size());
    const detail::stage_watch watch{summary.seconds.set_up};
    const auto fails = [&](const detail::pose_graph_finding& finding) {
      summary.status = finding.status;
      summary.where = finding.where;
      return is_failure(finding.status);
    };
    if (fails(detail::check_pose_graph<Between::dimension>(vertices, edges, options.semidefinite_information)))
      return false;
    bool changed = false;
    if (fails(structure_.update(vertices.size(), edges, options.fixed, options.hold, changed))) return false;
    if (structure_.vertices.empty()) {
      summary.status = pose_graph_status::nothing_to_do;
      return false;
    }
    if (changed) cholesky_.analyze(structure_.vertices.size(), structure_.places);
    estimate_.assign(vertices.begin(), vertices.end());
    tried_ = estimate_;
    const std::size_t unknowns = structure_.vertices.size();
    on_diagonal_.resize(unknowns);
    off_diagonal_.resize(structure_.places.size());
    shares_.resize(structure_.bundles.size());
    chunk_costs_.resize((structure_.bundles.size() + grain - 1) / grain);
    gradient_.resize(static_cast<Eigen::Index>(size * unknowns));
    diagonal_.resize(gradient_.size());
    return true;
  }

  /// Residuals, weights and normal equations at the estimate.
  template <class Policy, class Edges>
  void linearize(const Policy& policy, const Edges& edges) {
    for_each_chunk(policy, structure_.bundles.size(), grain, [&](std::size_t begin, std::size_t end) {
      double cost = 0.0;
      for (std::size_t b = begin; b != end; ++b) cost += linearize_bundle(b, edges);
      chunk_costs_[begin / grain] = cost;
    });
    cost_ = sum_of_chunks();
    for_each_chunk(policy, structure_.vertices.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t u = begin; u != end; ++u) gather(u);
    });
  }

  template <class Edges>
  [[nodiscard]] double linearize_bundle(std::size_t b, const Edges& edges) {
    const detail::edge_bundle& bundle = structure_.bundles[b];
    share& sum = shares_[b];
    sum.from.setZero();
    sum.to.setZero();
    sum.gradient_from.setZero();
    sum.gradient_to.setZero();
    block mixed = block::Zero();
    double cost = 0.0;
    for (std::uint32_t at = bundle.begin; at != bundle.begin + bundle.count; ++at) {
      const auto& e = edges[structure_.bundled[at]];
      matrix<Between::dimension, T::dof> whole_from, whole_to;
      const matrix<Between::dimension> r =
          between_.linearize(estimate_[e.from], estimate_[e.to], e.measurement, whole_from, whole_to);
      const matrix<Between::dimension, size> by_from = manifold_.reduce(whole_from);
      const matrix<Between::dimension, size> by_to = manifold_.reduce(whole_to);
      const matrix<Between::dimension> pull = e.information * r;
      const double squared = r.dot(pull);
      const double weight = loss_.weight(squared);
      cost += 0.5 * loss_.cost(squared);
      const matrix<Between::dimension, Between::dimension> information = weight * e.information;
      const bool along = e.from == bundle.from;
      const auto& from = along ? by_from : by_to;
      const auto& to = along ? by_to : by_from;
      const matrix<Between::dimension, size> weighted = information * to;
      sum.to.noalias() += to.transpose() * weighted;
      mixed.noalias() += from.transpose() * weighted;
      sum.from.noalias() += from.transpose() * (information * from);
      sum.gradient_from.noalias() += weight * (from.transpose() * pull);
      sum.gradient_to.noalias() += weight * (to.transpose() * pull);
    }
    if (b < off_diagonal_.size()) off_diagonal_[b] = mixed;
    return cost;
  }

  /// Adds up what the bundles at an unknown have to say.
  void gather(std::size_t u) {
    block hessian = block::Zero();
    vector gradient = vector::Zero();
    for (std::uint32_t at = structure_.first_touch[u]; at != structure_.first_touch[u + 1]; ++at) {
      const share& s = shares_[structure_.touches[at] / 2];
      const bool is_to = structure_.touches[at] % 2 != 0;
      hessian += is_to ? s.to : s.from;
      gradient += is_to ? s.gradient_to : s.gradient_from;
    }
    on_diagonal_[u] = hessian;
    const auto row = static_cast<Eigen::Index>(size * u);
    gradient_.template segment<size>(row) = gradient;
    diagonal_.template segment<size>(row) = hessian.diagonal();
  }

  /// The cost one step away from the estimate, which is left in `tried_`.
  template <class Policy, class Edges>
  [[nodiscard]] double evaluate(const Policy& policy, const Edges& edges, const Eigen::VectorXd& step) {
    for_each_chunk(policy, structure_.vertices.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t u = begin; u != end; ++u) {
        const std::uint32_t v = structure_.vertices[u];
        tried_[v] = manifold_.retract(estimate_[v], step.template segment<size>(static_cast<Eigen::Index>(size * u)));
      }
    });
    for_each_chunk(policy, structure_.bundles.size(), grain, [&](std::size_t begin, std::size_t end) {
      double cost = 0.0;
      const detail::edge_bundle& last = structure_.bundles[end - 1];
      for (std::uint32_t at = structure_.bundles[begin].begin; at != last.begin + last.count; ++at) {
        const auto& e = edges[structure_.bundled[at]];
        const matrix<Between::dimension> r = between_.residual(tried_[e.from], tried_[e.to], e.measurement);
        cost += 0.5 * loss_.cost(r.dot(e.information * r));
      }
      chunk_costs_[begin / grain] = cost;
    });
    return sum_of_chunks();
  }
  [[nodiscard]] double sum_of_chunks() const {
    double sum = 0.0;
    for (const double cost : chunk_costs_) sum += cost;
    return sum;
  }

  [[nodiscard]] double curvature(const Eigen::VectorXd& x) const {
    const auto part = [&](std::size_t u) { return x.template segment<size>(static_cast<Eigen::Index>(size * u)); };
    double sum = 0.0;
    for (std::size_t u = 0; u != on_diagonal_.size(); ++u) sum += part(u).dot(on_diagonal_[u] * part(u));
    for (std::size_t k = 0; k != off_diagonal_.size(); ++k)
      sum += 2.0 * part(structure_.places[k].row).dot(off_diagonal_[k] * part(structure_.places[k].column));
    return sum;
  }

  Loss loss_;
  Damping damping_;
  Between between_;
  Manifold manifold_;

  detail::pose_graph_structure structure_;
  block_cholesky<size> cholesky_;
  std::vector<T> estimate_, tried_, best_;
  double cost_ = 0.0, tried_cost_ = 0.0;
  std::vector<share> shares_;        // of each bundle
  std::vector<double> chunk_costs_;  // added in order, so that every policy adds alike
  std::vector<block> on_diagonal_;   // the normal equations
  std::vector<block> off_diagonal_;  // of the bundles between two unknowns
  Eigen::VectorXd gradient_, diagonal_;
  step_workspace workspace_;
};

/// Solves a pose graph once; see `pose_graph_solver::solve`.
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

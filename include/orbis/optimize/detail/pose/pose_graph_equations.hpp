// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The normal equations of a pose graph: linearisation, factorisation, and solution.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <orbis/core/execution.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/pose/pose_graph_structure.hpp>
#include <orbis/optimize/detail/sparse/block_cholesky.hpp>
#include <orbis/optimize/pose_graph_problem.hpp>

namespace orbis::optimize::detail {

/// The normal equations and the current estimate. The unknowns are the steps of the movable vertices, in the order of
/// `structure()`. Reuses its memory. Every execution policy gives the same bits.
template <class T, class Loss, class Between>
class pose_graph_equations {
 public:
  pose_graph_equations(const Loss& loss, const Between& between) : loss_{loss}, between_{between} {}

  [[nodiscard]] const pose_graph_structure& structure() const { return structure_; }
  [[nodiscard]] const std::vector<T>& estimate() const { return estimate_; }
  [[nodiscard]] double cost() const { return cost_; }
  [[nodiscard]] const Eigen::VectorXd& gradient() const { return gradient_; }
  [[nodiscard]] const Eigen::VectorXd& diagonal() const { return diagonal_; }

  /// Initialises with these vertices. Analyses the graph if it differs from that of the previous call.
  template <class Edges>
  [[nodiscard]] pose_graph_finding begin(std::span<const T> vertices, const Edges& edges,
                                         const pose_graph_options& options) {
    bool changed = false;
    const pose_graph_finding finding = structure_.update(vertices.size(), edges, options.fixed, options.hold, changed);
    if (is_failure(finding.status) || structure_.vertices.empty()) return finding;
    const std::size_t unknowns = structure_.vertices.size();
    if (changed) cholesky_.analyze(unknowns, structure_.places);
    estimate_.assign(vertices.begin(), vertices.end());
    tried_ = estimate_;
    on_diagonal_.resize(unknowns);
    off_diagonal_.resize(structure_.places.size());
    contributions_.resize(structure_.bundles.size());
    chunk_costs_.resize((structure_.bundles.size() + grain - 1) / grain);
    gradient_.resize(static_cast<Eigen::Index>(size * unknowns));
    diagonal_.resize(gradient_.size());
    return finding;
  }

  /// Computes residuals, weights and normal equations at the estimate.
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

  /// Returns `x^T H x`.
  [[nodiscard]] double curvature(const Eigen::VectorXd& x) const {
    const auto part = [&](std::size_t u) { return segment<size>(x, static_cast<Eigen::Index>(size * u)); };
    double sum = 0.0;
    for (std::size_t u = 0; u != on_diagonal_.size(); ++u) sum += dot(part(u), on_diagonal_[u] * part(u));
    for (std::size_t k = 0; k != off_diagonal_.size(); ++k)
      sum += 2.0 * dot(part(structure_.places[k].row), off_diagonal_[k] * part(structure_.places[k].column));
    return sum;
  }

  /// Factorises `H + diag(damping)`; an empty `damping` means 0. Returns false if the matrix is not positive definite.
  [[nodiscard]] bool factor(const Eigen::VectorXd& damping) {
    return cholesky_.factor(on_diagonal_, off_diagonal_, {damping.data(), static_cast<std::size_t>(damping.size())});
  }
  /// The undetermined vertex, after `factor` has returned false.
  [[nodiscard]] std::uint32_t failed_vertex() const { return structure_.vertices[cholesky_.failed_block()]; }
  /// Replaces a right-hand side by the solution.
  void solve(Eigen::VectorXd& x) { cholesky_.solve({x.data(), static_cast<std::size_t>(x.size())}); }

  /// Computes the cost after a step; `accept` then makes the result the estimate.
  template <class Policy, class Edges>
  [[nodiscard]] double try_step(const Policy& policy, const Edges& edges, const Eigen::VectorXd& step) {
    for_each_chunk(policy, structure_.vertices.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t u = begin; u != end; ++u) {
        const std::uint32_t v = structure_.vertices[u];
        tried_[v] = estimate_[v] * T::exp(segment<size>(step, static_cast<Eigen::Index>(size * u)));
      }
    });
    for_each_chunk(policy, structure_.bundles.size(), grain, [&](std::size_t begin, std::size_t end) {
      double cost = 0.0;
      const edge_bundle& last = structure_.bundles[end - 1];
      for (std::uint32_t at = structure_.bundles[begin].begin; at != last.begin + last.count; ++at) {
        const auto& e = edges[structure_.bundled[at]];
        const matrix<Between::dimension> r = between_.residual(tried_[e.from], tried_[e.to], e.measurement);
        cost += 0.5 * loss_.cost(dot(r, e.information * r));
      }
      chunk_costs_[begin / grain] = cost;
    });
    return tried_cost_ = sum_of_chunks();
  }
  void accept() {
    estimate_.swap(tried_);
    cost_ = tried_cost_;
  }

 private:
  static constexpr int size = T::dof;
  static constexpr std::size_t grain = 256;  ///< grain size of loops over bundles and vertices
  using block = matrix<size, size>;
  using vector = matrix<size>;

  /// The contribution of the edges of a bundle to the normal equations.
  struct contribution {
    block from, to;
    vector gradient_from, gradient_to;
  };

  template <class Edges>
  [[nodiscard]] double linearize_bundle(std::size_t b, const Edges& edges) {
    const edge_bundle& bundle = structure_.bundles[b];
    contribution& sum = contributions_[b];
    sum = {zeros<block>(), zeros<block>(), zeros<vector>(), zeros<vector>()};
    block mixed = zeros<block>();
    double cost = 0.0;
    for (std::uint32_t at = bundle.begin; at != bundle.begin + bundle.count; ++at) {
      const auto& e = edges[structure_.bundled[at]];
      matrix<Between::dimension, size> by_from, by_to;
      const matrix<Between::dimension> r =
          between_.linearize(estimate_[e.from], estimate_[e.to], e.measurement, by_from, by_to);
      const matrix<Between::dimension> pull = e.information * r;
      const double squared = dot(r, pull);
      const double weight = loss_.weight(squared);
      cost += 0.5 * loss_.cost(squared);
      const matrix<Between::dimension, Between::dimension> information = weight * e.information;
      const bool along = e.from == bundle.from;
      const auto& from = along ? by_from : by_to;
      const auto& to = along ? by_to : by_from;
      const matrix<Between::dimension, size> weighted = information * to;
      sum.to += transposed(to) * weighted;
      mixed += transposed(from) * weighted;
      sum.from += transposed(from) * (information * from);
      sum.gradient_from += weight * (transposed(from) * pull);
      sum.gradient_to += weight * (transposed(to) * pull);
    }
    if (b < off_diagonal_.size()) off_diagonal_[b] = mixed;
    return cost;
  }

  /// Sums the contributions of all bundles that connect an unknown to other vertices.
  void gather(std::size_t u) {
    block hessian = zeros<block>();
    vector gradient = zeros<vector>();
    for (std::uint32_t at = structure_.first_touch[u]; at != structure_.first_touch[u + 1]; ++at) {
      const contribution& s = contributions_[structure_.touches[at] / 2];
      const bool is_to = structure_.touches[at] % 2 != 0;
      hessian += is_to ? s.to : s.from;
      gradient += is_to ? s.gradient_to : s.gradient_from;
    }
    on_diagonal_[u] = hessian;
    const auto row = static_cast<Eigen::Index>(size * u);
    for (int i = 0; i != size; ++i) {
      gradient_[row + i] = gradient[i];
      diagonal_[row + i] = hessian(i, i);
    }
  }

  [[nodiscard]] double sum_of_chunks() const {
    double sum = 0.0;
    for (const double cost : chunk_costs_) sum += cost;
    return sum;
  }

  Loss loss_;
  Between between_;
  pose_graph_structure structure_;
  block_cholesky<size> cholesky_;
  std::vector<T> estimate_, tried_;
  double cost_ = 0.0, tried_cost_ = 0.0;
  std::vector<contribution> contributions_;  // contribution of each bundle
  std::vector<double> chunk_costs_;          // summed in order, so that every policy gives the same result
  std::vector<block> on_diagonal_;           // diagonal blocks of the normal equations
  std::vector<block> off_diagonal_;          // blocks of the bundles between two unknowns
  Eigen::VectorXd gradient_, diagonal_;
};

}  // namespace orbis::optimize::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the tests of pose graphs share.
#pragma once

#include <algorithm>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/optimize/pose_graph-inl.hpp>

#include "support/synthetic/pose_graph.hpp"

namespace orbis::test {

/// A few hundred poses of each shape; odometry goes astray, but not beyond recovery.
inline std::vector<test::synthetic_graph> small_graphs(double noise = 1.0) {
  std::vector<test::synthetic_graph> graphs;
  const auto add = [&](test::graph_shape shape, int poses, int turns) {
    graphs.push_back(test::make_pose_graph({.shape = shape,
                                            .poses_per_turn = poses,
                                            .turns = turns,
                                            .radius = 10.0,
                                            .translation_sigma = 0.05 * noise,
                                            .rotation_sigma = 0.02 * noise,
                                            .closure_probability = 0.8,
                                            .seed = 17}));
  };
  add(test::graph_shape::sphere, 20, 15);
  add(test::graph_shape::torus, 16, 20);
  add(test::graph_shape::grid, 7, 0);
  return graphs;
}

/// Solves a pose graph once, with a solver that is made for it.
template <class Policy, class T, class Edges, class Loss = optimize::trivial, class Damping = optimize::dogleg>
optimize::pose_graph_summary solve_pose_graph(const Policy& policy, std::vector<T>& vertices, const Edges& edges,
                                              const optimize::pose_graph_options& options = {}, progress callback = {},
                                              const Loss& loss = {}, const Damping& damping = {}) {
  optimize::pose_graph_solver<T, Loss, Damping> solver{loss, damping};
  return solver.solve(policy, std::span<T>{vertices}, edges, options, std::move(callback));
}

template <class Damping = optimize::levenberg_marquardt, class Loss = optimize::trivial, class Policy, class Edges>
optimize::pose_graph_summary solve(const Policy& policy, std::vector<se3>& vertices, const Edges& edges,
                                   const optimize::pose_graph_options& options = {}, Loss loss = {},
                                   Damping damping = {}) {
  return solve_pose_graph(policy, vertices, edges, options, {}, loss, damping);
}

/// Root mean square of the distances between the poses' positions.
inline double position_error(const std::vector<se3>& a, const std::vector<se3>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i != a.size(); ++i) sum += (a[i].translation() - b[i].translation()).squaredNorm();
  return std::sqrt(sum / static_cast<double>(a.size()));
}

inline bool same_bits(const std::vector<se3>& a, const std::vector<se3>& b) {
  const auto equal = [](const se3& p, const se3& q) {
    return p.translation() == q.translation() &&
           p.rotation().unit_quaternion().coeffs() == q.rotation().unit_quaternion().coeffs();
  };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), equal);
}

}  // namespace orbis::test

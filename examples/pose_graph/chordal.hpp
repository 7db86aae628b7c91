// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Initialisation of pose graphs whose odometry is too inaccurate as an initial estimate.
#pragma once

#include <cstddef>
#include <ranges>
#include <span>
#include <vector>

#include <Eigen/LU>

#include <orbis/core/execution.hpp>
#include <orbis/core/jacobi.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/pose_graph-inl.hpp>

namespace examples {

/// A graph vertex that is a vector of N numbers. The optimiser updates it by addition, so that the optimisation is a
/// linear least-squares problem.
template <int N>
struct numbers {
  static constexpr int dof = N;
  orbis::matrix<N> values = orbis::matrix<N>::Zero();

  [[nodiscard]] static numbers exp(const orbis::matrix<N>& d) { return {d}; }
  [[nodiscard]] friend numbers operator*(const numbers& a, const numbers& b) { return {a.values + b.values}; }
  [[nodiscard]] const orbis::matrix<N>& to_matrix() const { return values; }
};

/// The residual `R_b - R_a * R_a_b` for unconstrained matrices, each stored column by column as nine numbers.
struct rotation_difference {
  static constexpr int dimension = 9;
  using vertex = numbers<9>;
  using jacobian = orbis::matrix<9, 9>;

  [[nodiscard]] static orbis::matrix<9> residual(const vertex& a, const vertex& b, const vertex& a_b) {
    orbis::matrix<9> r = b.values;
    for (int column = 0; column != 3; ++column)
      for (int k = 0; k != 3; ++k) r.segment<3>(3 * column) -= a_b.values[3 * column + k] * a.values.segment<3>(3 * k);
    return r;
  }
  [[nodiscard]] static orbis::matrix<9> linearize(const vertex& a, const vertex& b, const vertex& a_b, jacobian& by_a,
                                                  jacobian& by_b) {
    by_b.setIdentity();
    for (int column = 0; column != 3; ++column)
      for (int k = 0; k != 3; ++k)
        by_a.block<3, 3>(3 * column, 3 * k) = -a_b.values[3 * column + k] * orbis::mat3::Identity();
    return residual(a, b, a_b);
  }
};

/// The residual `t_b - t_a - t_a_b` in the world frame.
struct position_difference {
  static constexpr int dimension = 3;
  using vertex = numbers<3>;

  [[nodiscard]] static orbis::vec3 residual(const vertex& a, const vertex& b, const vertex& a_b) {
    return b.values - a.values - a_b.values;
  }
  [[nodiscard]] static orbis::vec3 linearize(const vertex& a, const vertex& b, const vertex& a_b, orbis::mat3& by_a,
                                             orbis::mat3& by_b) {
    by_a = -orbis::mat3::Identity();
    by_b = orbis::mat3::Identity();
    return residual(a, b, a_b);
  }
};

/// Computes all vertices that are not fixed from the edges alone, independently of their initial poses. Solves two
/// linear least-squares problems: first for unconstrained matrices, which are projected to the nearest rotations, then
/// for the positions. Edges are weighted by their information. Only the options `fixed`, `hold` and
/// `semidefinite_information` are used. Fixed and held vertices remain unchanged; on failure, all vertices remain
/// unchanged (`singular`: vertex `where` is not determined, or has no nearest rotation).
///
/// Sources: L. Carlone, R. Tron, K. Daniilidis, F. Dellaert, "Initialization techniques for 3D SLAM: a survey on
/// rotation estimation and its use in pose graph optimization", ICRA 2015; D. Martinec, T. Pajdla, "Robust rotation and
/// translation estimation in multiview reconstruction", CVPR 2007.
/// @pre `options.fixed` is empty or has one entry for each vertex
template <std::ranges::contiguous_range Edges>
[[nodiscard]] orbis::optimize::pose_graph_summary start_chordally(std::span<orbis::se3> vertices, const Edges& edges,
                                                                  orbis::optimize::pose_graph_options options = {}) {
  namespace optimize = orbis::optimize;
  options.max_iterations = 2;  // the first solves the linear system, the second detects convergence
  const auto solve = [&]<class Difference>(Difference difference, auto& unknowns, const auto& system) {
    using vertex = typename Difference::vertex;
    optimize::pose_graph_solver<vertex, optimize::trivial, optimize::gauss_newton, Difference> solver{
        {}, {}, difference};
    return solver.solve(orbis::seq, std::span<vertex>{unknowns}, system, options);
  };

  std::vector<numbers<9>> columns(vertices.size());
  for (std::size_t v = 0; v != vertices.size(); ++v) columns[v].values = vertices[v].rotation_matrix().reshaped();
  std::vector<optimize::pose_graph_edge<numbers<9>>> turns;
  for (const auto& e : edges) {
    const double weight = e.information.template bottomRightCorner<3, 3>().trace() / 3.0;
    turns.push_back(
        {e.from, e.to, {e.measurement.rotation_matrix().reshaped()}, weight * orbis::matrix<9, 9>::Identity()});
  }
  const std::vector<numbers<9>> before = columns;
  optimize::pose_graph_summary done = solve(rotation_difference{}, columns, turns);
  if (is_failure(done.status) || done.status == optimize::pose_graph_status::nothing_to_do) return done;
  std::vector<orbis::so3> rotations(vertices.size());
  for (std::size_t v = 0; v != vertices.size(); ++v) {
    rotations[v] = vertices[v].rotation();
    if (columns[v].values == before[v].values) continue;
    const orbis::mat3 relaxed = columns[v].values.reshaped(3, 3);
    auto [left, sizes, right] = orbis::svd<3>(relaxed);
    if (!(sizes[1] > 1e-9 * sizes[0])) {
      done.status = optimize::pose_graph_status::singular;
      done.where = v;
      return done;
    }
    if (left.determinant() * right.determinant() < 0.0) left.col(2) = -left.col(2);
    rotations[v] = orbis::so3{orbis::mat3(left * right.transpose())};
  }

  std::vector<numbers<3>> positions(vertices.size());
  for (std::size_t v = 0; v != vertices.size(); ++v) positions[v].values = vertices[v].translation();
  std::vector<optimize::pose_graph_edge<numbers<3>>> moves;
  for (const auto& e : edges) {
    const orbis::mat3 r = rotations[e.from].rotation_matrix();
    const orbis::mat3 turned = r * e.measurement.rotation_matrix();
    // The information refers to the translation in the measured frame of `to`.
    moves.push_back({e.from,
                     e.to,
                     {r * e.measurement.translation()},
                     turned * e.information.template topLeftCorner<3, 3>() * turned.transpose()});
  }
  done = solve(position_difference{}, positions, moves);
  if (is_failure(done.status)) return done;
  for (std::size_t v = 0; v != vertices.size(); ++v) vertices[v] = orbis::se3{rotations[v], positions[v].values};
  done.status = optimize::pose_graph_status::converged;
  return done;
}

}  // namespace examples

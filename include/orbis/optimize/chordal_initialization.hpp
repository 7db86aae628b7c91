// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Where to start a pose graph whose odometry has gone too far astray: rotations first, without
/// their constraints, then positions. Both are linear least squares, so no start is needed.
///
/// Sources: L. Carlone, R. Tron, K. Daniilidis, F. Dellaert, "Initialization techniques for 3D SLAM: a
/// survey on rotation estimation and its use in pose graph optimization", ICRA 2015; D. Martinec,
/// T. Pajdla, "Robust rotation and translation estimation in multiview reconstruction", CVPR 2007.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <ranges>
#include <span>
#include <string>
#include <vector>

#include <Eigen/LU>

#include <orbis/core/jacobi.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/pose/pose_graph_structure.hpp>
#include <orbis/optimize/detail/sparse/block_cholesky.hpp>

namespace orbis::optimize {

struct chordal_options {
  std::span<const std::uint8_t> fixed{};  ///< empty, or one for each vertex: not 0 keeps it where it is
  pose_graph_gauge hold = pose_graph_gauge::automatic;
  bool semidefinite_information = false;  ///< whether edges may say nothing about some direction
};

/// What became of an initialisation; never `iteration_limit`, `cancelled` or `no_progress`.
struct chordal_summary {
  pose_graph_status status = pose_graph_status::nothing_to_do;
  std::size_t where = 0;  ///< the edge or vertex that a failure is about
};

[[nodiscard]] inline std::string to_string(const chordal_summary& s) { return describe(s.status, s.where); }

namespace detail {

/// The rotation closest to a matrix that may even mirror, after so much noise; none for one of rank 1.
template <std::same_as<double> S = double>
[[nodiscard]] std::optional<so3> proper_rotation(const matrix<3, 3, S>& m) {
  using mat3 = matrix<3, 3, S>;
  if (!m.allFinite()) return std::nullopt;
  auto [u, values, v] = singular_values_of<3>(m);
  if (!(values[1] > 1e-9 * values[0])) return std::nullopt;
  if (u.determinant() * v.determinant() < 0.0) u.col(2) = -u.col(2);
  return so3{mat3(u * v.transpose())};
}

/// Linear least squares in vectors of three, one or several at each vertex, over the edges of a graph.
template <std::same_as<double> S = double>  // so that only who initialises has it compiled
class vertex_vectors {
  using vec3 = matrix<3, 1, S>;
  using mat3 = matrix<3, 3, S>;

 public:
  vertex_vectors(const pose_graph_structure& structure, std::size_t right_sides)
      : structure_{structure}, right_(right_sides) {
    cholesky_.analyze(structure.vertices.size(), structure.places);
    clear();
  }

  void clear() {
    diagonal_.assign(structure_.vertices.size(), mat3::Zero());
    off_diagonal_.assign(structure_.places.size(), mat3::Zero());
    for (std::vector<double>& x : right_) x.assign(3 * structure_.vertices.size(), 0.0);
  }

  /// Adds |to - turn * from - offset|^2 in the norm of `weight`, for every right-hand side.
  /// `known(v, side)` is the vector of a vertex that does not move, `offset(side)` that of the edge.
  template <class Known, class Offset>
  void add(std::size_t bundle, std::uint32_t from, std::uint32_t to, const mat3& turn, const mat3& weight,
           Known&& known, Offset&& offset) {
    const std::uint32_t a = structure_.unknown[from], b = structure_.unknown[to];
    constexpr std::uint32_t held = pose_graph_structure::held;
    const mat3 back = turn.transpose() * weight;
    if (a != held) diagonal_[a] += back * turn;
    if (b != held) diagonal_[b] += weight;
    if (a != held && b != held)
      off_diagonal_[bundle] -= structure_.places[bundle].row == a ? back : mat3(weight * turn);
    for (std::size_t side = 0; side != right_.size(); ++side) {
      vec3 target = offset(side);
      if (a == held) target += turn * known(from, side);
      if (b == held) target -= known(to, side);
      if (a != held) part(side, a) -= back * target;
      if (b != held) part(side, b) += weight * target;
    }
  }

  /// False where the edges do not determine a vertex: see `failed_vertex`.
  [[nodiscard]] bool solve() {
    if (!cholesky_.factor(diagonal_, off_diagonal_)) return false;
    for (std::vector<double>& x : right_) cholesky_.solve(x);
    return true;
  }
  [[nodiscard]] vec3 solution(std::size_t side, std::uint32_t unknown) { return part(side, unknown); }
  [[nodiscard]] std::uint32_t failed_vertex() const { return structure_.vertices[cholesky_.failed_block()]; }

 private:
  [[nodiscard]] Eigen::Map<vec3> part(std::size_t side, std::uint32_t unknown) {
    return Eigen::Map<vec3>{right_[side].data() + 3 * std::size_t{unknown}};
  }

  const pose_graph_structure& structure_;
  block_cholesky<std::same_as<S, double> ? 3 : 0> cholesky_;
  std::vector<mat3> diagonal_, off_diagonal_;
  std::vector<std::vector<double>> right_;
};

}  // namespace detail

/// Replaces the vertices that are not fixed by a start made of the edges alone, wherever they were:
/// rotations by the chordal relaxation, then the positions that fit best with these rotations. Edges
/// weigh by their information. What is fixed, and the first vertex of a piece that is held by it,
/// stays; so do all vertices where the status is a failure (`singular`: the vertex `where` is not
/// determined, or its rotation is none). O(blocks of the factor), like two steps of a solver.
/// @pre `options.fixed` is empty or has one entry for each vertex
template <std::ranges::contiguous_range Edges>
requires relative_measurement<std::ranges::range_value_t<Edges>, se3> chordal_summary
initialize_chordally(std::span<se3> vertices, const Edges& edges, const chordal_options& options = {}) {
  const std::span all{std::ranges::data(edges), std::ranges::size(edges)};
  const auto found = detail::check_pose_graph<6>(std::span<const se3>{vertices}, all, options.semidefinite_information);
  if (is_failure(found.status)) return {found.status, found.where};
  detail::pose_graph_structure structure;
  bool changed = false;
  const auto held = structure.update(vertices.size(), all, options.fixed, options.hold, changed);
  if (is_failure(held.status)) return {held.status, held.where};
  if (structure.vertices.empty()) return {};

  const auto for_each_edge = [&](auto&& visit) {
    for (std::size_t b = 0; b != structure.bundles.size(); ++b)
      for (std::uint32_t k = 0; k != structure.bundles[b].count; ++k)
        visit(b, all[structure.bundled[structure.bundles[b].begin + k]]);
  };

  // Rotations: R_to = R_from * R_from_to, row by row.
  detail::vertex_vectors<> rows{structure, 3};
  for_each_edge([&](std::size_t bundle, const auto& e) {
    const mat3 turn = e.measurement.rotation_matrix().transpose();
    const double weight = e.information.template bottomRightCorner<3, 3>().trace() / 3.0;
    rows.add(
        bundle, e.from, e.to, turn, weight * mat3::Identity(),
        [&](std::uint32_t v, std::size_t side) {
          return vec3(vertices[v].rotation_matrix().row(static_cast<Eigen::Index>(side)).transpose());
        },
        [](std::size_t) { return vec3(vec3::Zero()); });
  });
  if (!rows.solve()) return {pose_graph_status::singular, rows.failed_vertex()};
  std::vector<so3> rotations(vertices.size());
  for (std::size_t v = 0; v != vertices.size(); ++v) {
    const std::uint32_t u = structure.unknown[v];
    rotations[v] = vertices[v].rotation();
    if (u == detail::pose_graph_structure::held) continue;
    mat3 relaxed;
    for (std::size_t side = 0; side != 3; ++side)
      relaxed.row(static_cast<Eigen::Index>(side)) = rows.solution(side, u).transpose();
    const auto nearest = detail::proper_rotation(relaxed);
    if (!nearest) return {pose_graph_status::singular, v};
    rotations[v] = *nearest;
  }

  // Positions: t_to = t_from + R_from * t_from_to.
  detail::vertex_vectors<> positions{structure, 1};
  for_each_edge([&](std::size_t bundle, const auto& e) {
    const mat3 r = rotations[e.from].rotation_matrix();
    const mat3 turned = r * e.measurement.rotation_matrix();
    // The information is about the translation in the measured frame of `to`.
    const mat3 weight = turned * e.information.template topLeftCorner<3, 3>() * turned.transpose();
    positions.add(
        bundle, e.from, e.to, mat3::Identity(), weight,
        [&](std::uint32_t v, std::size_t) { return vertices[v].translation(); },
        [&](std::size_t) { return vec3(r * e.measurement.translation()); });
  });
  if (!positions.solve()) return {pose_graph_status::singular, positions.failed_vertex()};
  for (std::uint32_t u = 0; u != structure.vertices.size(); ++u) {
    const std::uint32_t v = structure.vertices[u];
    vertices[v] = se3{rotations[v], positions.solution(0, u)};
  }
  return {pose_graph_status::converged, 0};
}

}  // namespace orbis::optimize

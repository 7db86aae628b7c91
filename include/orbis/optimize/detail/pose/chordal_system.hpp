// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The linear systems of the chordal initialisation of pose graphs.
///
/// Sources: L. Carlone, R. Tron, K. Daniilidis, F. Dellaert, "Initialization techniques for 3D SLAM: a survey on
/// rotation estimation and its use in pose graph optimization", ICRA 2015; D. Martinec, T. Pajdla, "Robust rotation and
/// translation estimation in multiview reconstruction", CVPR 2007.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/LU>

#include <orbis/core/jacobi.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/pose/pose_graph_structure.hpp>
#include <orbis/optimize/detail/sparse/block_cholesky.hpp>

namespace orbis::optimize::detail {

/// The rotation nearest to `m`, whose determinant may even be negative; empty where `m` has rank 1.
[[nodiscard]] inline std::optional<so3> nearest_rotation(const mat3& m) {
  if (!all_finite(m)) return std::nullopt;
  auto [u, values, v] = singular_values_of<3>(m);
  if (!(values[1] > 1e-9 * values[0])) return std::nullopt;
  if (determinant(u) * determinant(v) < 0.0) u.col(2) = -u.col(2);
  return so3{mat3(u * transposed(v))};
}

/// Linear least squares over the edges of a graph. The unknowns are one or more vectors of three numbers per vertex,
/// with one right-hand side for each.
class chordal_system {
 public:
  chordal_system(const pose_graph_structure& structure, std::size_t right_sides)
      : structure_{structure}, right_(right_sides) {
    cholesky_.analyze(structure.vertices.size(), structure.places);
    clear();
  }

  void clear() {
    diagonal_.assign(structure_.vertices.size(), zeros<mat3>());
    off_diagonal_.assign(structure_.places.size(), zeros<mat3>());
    for (std::vector<double>& x : right_) x.assign(3 * structure_.vertices.size(), 0.0);
  }

  /// Adds |to - turn * from - offset|^2 in the norm of `weight`, for every right-hand side.
  /// `known(v, side)` is the vector of a vertex that does not move, `offset(side)` that of the edge.
  template <class Known, class Offset>
  void add(std::size_t bundle, std::uint32_t from, std::uint32_t to, const mat3& turn, const mat3& weight,
           Known&& known, Offset&& offset) {
    const std::uint32_t a = structure_.unknown[from], b = structure_.unknown[to];
    constexpr std::uint32_t held = pose_graph_structure::held;
    const mat3 back = transposed(turn) * weight;
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
  block_cholesky<3> cholesky_;
  std::vector<mat3> diagonal_, off_diagonal_;
  std::vector<std::vector<double>> right_;
};

}  // namespace orbis::optimize::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A start for pose graphs whose odometry is too far off.
#pragma once

#include <cstddef>
#include <cstdint>
#include <ranges>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <orbis/core/se3.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/pose/chordal_system.hpp>
#include <orbis/optimize/detail/pose/pose_graph_structure.hpp>
#include <orbis/optimize/pose_graph_problem.hpp>

namespace orbis::optimize {

/// Result of a chordal initialisation: `converged`, `nothing_to_do` or a failure.
struct chordal_summary {
  pose_graph_status status = pose_graph_status::nothing_to_do;
  std::size_t where = 0;  ///< the edge or vertex that a failure is about
};

/// The status in words.
[[nodiscard]] inline std::string to_string(const chordal_summary& s) { return describe(s.status, s.where); }

/// A start for a solver, for graphs whose odometry is too far off: computes all vertices that are not fixed from the
/// edges alone; where they were does not matter. Two linear least-squares problems: first the rotations without their
/// constraints, each projected to the nearest rotation, then the positions. Edges weigh by their information. Of the
/// options `fixed`, `hold` and `semidefinite_information` count. Vertices that are fixed or held stay; on failure all
/// do
/// (`singular`: vertex `where` is not determined, or has no nearest rotation). O(blocks of the factor), about two steps
/// of a solver.
///
/// Source: L. Carlone, R. Tron, K. Daniilidis, F. Dellaert, "Initialization techniques for 3D SLAM: a survey on
/// rotation estimation and its use in pose graph optimization", ICRA 2015.
/// @pre `options.fixed` is empty or has one entry for each vertex
template <std::ranges::contiguous_range Edges>
requires relative_measurement<std::ranges::range_value_t<Edges>, se3> chordal_summary
initialize_chordally(std::span<se3> vertices, const Edges& edges, const pose_graph_options& options = {}) {
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
  detail::chordal_system rows{structure, 3};
  for_each_edge([&](std::size_t bundle, const auto& e) {
    const mat3 turn = transposed(e.measurement.rotation_matrix());
    const double weight = trace(e.information.template bottomRightCorner<3, 3>()) / 3.0;
    rows.add(
        bundle, e.from, e.to, turn, weight * identity<mat3>(),
        [&](std::uint32_t v, std::size_t side) {
          return vec3(transposed(vertices[v].rotation_matrix().row(static_cast<Eigen::Index>(side))));
        },
        [](std::size_t) { return vec3(zeros<vec3>()); });
  });
  if (!rows.solve()) return {pose_graph_status::singular, rows.failed_vertex()};
  std::vector<so3> rotations(vertices.size());
  for (std::size_t v = 0; v != vertices.size(); ++v) {
    const std::uint32_t u = structure.unknown[v];
    rotations[v] = vertices[v].rotation();
    if (u == detail::pose_graph_structure::held) continue;
    mat3 relaxed;
    for (std::size_t side = 0; side != 3; ++side)
      relaxed.row(static_cast<Eigen::Index>(side)) = transposed(rows.solution(side, u));
    const auto nearest = detail::nearest_rotation(relaxed);
    if (!nearest) return {pose_graph_status::singular, v};
    rotations[v] = *nearest;
  }

  // Positions: t_to = t_from + R_from * t_from_to.
  detail::chordal_system positions{structure, 1};
  for_each_edge([&](std::size_t bundle, const auto& e) {
    const mat3 r = rotations[e.from].rotation_matrix();
    const mat3 turned = r * e.measurement.rotation_matrix();
    // The information is about the translation in the measured frame of `to`.
    const mat3 weight = turned * block<3, 3>(e.information, 0, 0) * transposed(turned);
    positions.add(
        bundle, e.from, e.to, identity<mat3>(), weight,
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

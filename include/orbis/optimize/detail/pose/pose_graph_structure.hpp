// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Validation of pose graphs, and the structure of their normal equations: which vertices and edges share blocks.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/sparse/block_ordering.hpp>
#include <orbis/optimize/pose_graph_problem.hpp>

namespace orbis::optimize::detail {

/// The result of checking a graph: a status, and the index of the vertex or edge that caused a failure.
struct pose_graph_finding {
  pose_graph_status status = pose_graph_status::converged;  ///< `converged` means no failure
  std::size_t where = 0;
};

/// Returns true if a matrix is symmetric and positive definite; the units of its rows do not affect the result.
/// Optionally also accepts semidefinite matrices.
template <int N>
[[nodiscard]] bool is_information(const matrix<N, N>& given, bool semidefinite) {
  if (!all_finite(given)) return false;
  double inverse_scale[N];
  for (int i = 0; i != N; ++i) {
    if (!(semidefinite ? given(i, i) >= 0.0 : given(i, i) > 0.0)) return false;
    inverse_scale[i] = given(i, i) > 0.0 ? 1.0 / std::sqrt(given(i, i)) : 1.0;
  }
  matrix<N, N> m;
  for (int i = 0; i != N; ++i)
    for (int j = 0; j != N; ++j) m(i, j) = given(i, j) * inverse_scale[i] * inverse_scale[j];
  if (!(largest_magnitude(m - transposed(m)) <= 1e-6)) return false;
  if (semidefinite) change_diagonal(m, 1.0, 1e-9);
  for (int j = 0; j != N; ++j) {  // Cholesky factorisation
    for (int i = j; i != N; ++i)
      for (int k = 0; k != j; ++k) m(i, j) -= m(i, k) * m(j, k);
    if (!(m(j, j) > (semidefinite ? 0.0 : 1e-12))) return false;
    const double inverse = 1.0 / std::sqrt(m(j, j));
    for (int i = j; i != N; ++i) m(i, j) *= inverse;
  }
  return true;
}

/// Returns the first invalid vertex or edge.
template <int Dimension, class T, class Edges>
[[nodiscard]] pose_graph_finding check_pose_graph(std::span<const T> vertices, const Edges& edges,
                                                  bool semidefinite_information) {
  const auto is_finite = [](const T& pose) {
    if constexpr (requires { pose.to_matrix(); })
      return all_finite(pose.to_matrix());
    else
      return all_finite(pose.rotation_matrix());
  };
  for (std::size_t i = 0; i != vertices.size(); ++i)
    if (!is_finite(vertices[i])) return {pose_graph_status::bad_vertex, i};
  for (std::size_t k = 0; k != edges.size(); ++k) {
    const auto& e = edges[k];
    if (e.from >= vertices.size() || e.to >= vertices.size()) return {pose_graph_status::missing_vertex, k};
    if (e.from == e.to) return {pose_graph_status::self_edge, k};
    if (!is_finite(e.measurement)) return {pose_graph_status::bad_measurement, k};
    if (!is_information<Dimension>(e.information, semidefinite_information))
      return {pose_graph_status::bad_information, k};
  }
  return {};
}

/// All edges between the same two vertices, at least one of which is movable.
struct edge_bundle {
  std::uint32_t from = 0, to = 0;      ///< the vertices, in the direction of the bundle's first edge
  std::uint32_t begin = 0, count = 0;  ///< range in `pose_graph_structure::bundled`
};

/// The unknowns and blocks of a graph. Reused as long as the edges connect the same vertices.
template <class = void>
class basic_pose_graph_structure {
 public:
  static constexpr std::uint32_t held = std::numeric_limits<std::uint32_t>::max();

  std::vector<std::uint32_t> unknown;               ///< for each vertex: its index among the movable ones, or `held`
  std::vector<std::uint32_t> vertices;              ///< the vertex of each unknown
  std::vector<edge_bundle> bundles;                 ///< bundles between two unknowns come first
  std::vector<std::uint32_t> bundled;               ///< indices of the edges, ordered by bundle
  std::vector<block_place> places;                  ///< for each bundle between two unknowns, in order: its block
  std::vector<std::uint32_t> first_touch, touches;  ///< for each unknown, its bundles: 2 * bundle, plus 1 if it is `to`

  /// Determines the unknowns and, if the graph differs from that of the previous call, the blocks (`changed` is then
  /// true).
  /// @pre the edges refer to existing vertices
  template <class Edges>
  [[nodiscard]] pose_graph_finding update(std::size_t vertex_count, const Edges& edges,
                                          std::span<const std::uint8_t> fixed, pose_graph_gauge policy, bool& changed) {
    if (pose_graph_finding finding = find_unknowns(vertex_count, edges, fixed, policy); is_failure(finding.status))
      return finding;
    const auto same = [](const block_place& p, const auto& e) { return p.row == e.from && p.column == e.to; };
    changed = !(known_unknown_ == unknown &&
                std::equal(known_edges_.begin(), known_edges_.end(), edges.begin(), edges.end(), same));
    if (!changed) return {};
    known_unknown_ = unknown;
    known_edges_.clear();
    known_edges_.reserve(edges.size());
    for (const auto& e : edges) known_edges_.push_back({e.from, e.to});
    bundle_edges();
    return {};
  }

 private:
  template <class Edges>
  [[nodiscard]] pose_graph_finding find_unknowns(std::size_t vertex_count, const Edges& edges,
                                                 std::span<const std::uint8_t> fixed, pose_graph_gauge policy) {
    const auto is_fixed = [&](std::uint32_t v) { return !fixed.empty() && fixed[v] != 0; };
    root_.resize(vertex_count);
    std::iota(root_.begin(), root_.end(), 0U);
    touched_.assign(vertex_count, 0);
    for (const auto& e : edges) {
      touched_[e.from] = touched_[e.to] = 1;
      const std::uint32_t a = find_root(e.from), b = find_root(e.to);
      root_[std::max(a, b)] = std::min(a, b);  // makes the root the first vertex of its component
    }
    // Marks the components with a fixed vertex.
    anchored_.assign(vertex_count, 0);
    for (std::uint32_t v = 0; v != vertex_count; ++v)
      if (is_fixed(v)) anchored_[find_root(v)] = 1;
    std::size_t pieces = 0;
    for (std::uint32_t v = 0; v != vertex_count; ++v) pieces += touched_[v] != 0 && find_root(v) == v ? 1 : 0;
    const bool hold_first =
        policy == pose_graph_gauge::first_of_each_piece || (policy == pose_graph_gauge::automatic && pieces == 1);

    unknown.assign(vertex_count, held);
    vertices.clear();
    for (std::uint32_t v = 0; v != vertex_count; ++v) {
      if (touched_[v] == 0 || is_fixed(v)) continue;
      const std::uint32_t root = find_root(v);
      if (anchored_[root] == 0) {
        if (!hold_first) return {pose_graph_status::no_gauge, v};
        if (root == v) continue;
      }
      unknown[v] = static_cast<std::uint32_t>(vertices.size());
      vertices.push_back(v);
    }
    return {};
  }

  [[nodiscard]] std::uint32_t find_root(std::uint32_t v) {
    while (root_[v] != v) v = root_[v] = root_[root_[v]];
    return v;
  }

  void bundle_edges() {
    const auto ends = [&](std::uint32_t k) {
      const block_place& e = known_edges_[k];
      return block_place{std::min(e.row, e.column), std::max(e.row, e.column)};
    };
    const auto between_unknowns = [&](std::uint32_t k) {
      return unknown[known_edges_[k].row] != held && unknown[known_edges_[k].column] != held;
    };
    bundled.clear();
    for (std::uint32_t k = 0; k != known_edges_.size(); ++k)
      if (unknown[known_edges_[k].row] != held || unknown[known_edges_[k].column] != held) bundled.push_back(k);
    std::sort(bundled.begin(), bundled.end(), [&](std::uint32_t a, std::uint32_t b) {
      if (between_unknowns(a) != between_unknowns(b)) return between_unknowns(a);
      const block_place p = ends(a), q = ends(b);
      return p.row != q.row ? p.row < q.row : p.column != q.column ? p.column < q.column : a < b;
    });
    bundles.clear();
    places.clear();
    for (std::uint32_t at = 0; at != bundled.size(); ++at) {
      const block_place& e = known_edges_[bundled[at]];
      if (at != 0 && ends(bundled[at]) == ends(bundled[at - 1])) {
        ++bundles.back().count;
        continue;
      }
      bundles.push_back({e.row, e.column, at, 1});
      if (between_unknowns(bundled[at])) places.push_back({unknown[e.row], unknown[e.column]});
    }
    first_touch.assign(vertices.size() + 1, 0);
    const auto for_each_touch = [&](auto&& visit) {
      for (std::uint32_t b = 0; b != bundles.size(); ++b) {
        if (const std::uint32_t u = unknown[bundles[b].from]; u != held) visit(u, 2 * b);
        if (const std::uint32_t u = unknown[bundles[b].to]; u != held) visit(u, 2 * b + 1);
      }
    };
    for_each_touch([&](std::uint32_t u, std::uint32_t) { ++first_touch[u + 1]; });
    std::partial_sum(first_touch.begin(), first_touch.end(), first_touch.begin());
    touches.resize(first_touch.back());
    std::vector<std::uint32_t> next(first_touch.begin(), first_touch.end() - 1);
    for_each_touch([&](std::uint32_t u, std::uint32_t touch) { touches[next[u]++] = touch; });
  }

  std::vector<std::uint32_t> known_unknown_;
  std::vector<block_place> known_edges_;
  std::vector<std::uint32_t> root_;
  std::vector<std::uint8_t> touched_, anchored_;
};
using pose_graph_structure = basic_pose_graph_structure<>;

}  // namespace orbis::optimize::detail

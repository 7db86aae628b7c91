// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The essential graph: the few edges between keyframes over which the correction of a loop is distributed.
///
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM: a versatile and accurate monocular SLAM system",
/// T-RO 31 (2015), section III.D.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/pose_graph-inl.hpp>
#include <orbis/optimize/pose_graph_problem.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam::detail {

enum class edge_kind { tree, loop, covisibility };

[[nodiscard]] constexpr std::string_view to_string(edge_kind kind) noexcept {
  switch (kind) {
    case edge_kind::tree: return "tree";
    case edge_kind::loop: return "loop";
    case edge_kind::covisibility: return "covisibility";
  }
  return "unknown";
}

/// An edge of a pose graph.
struct essential_edge {
  std::uint32_t from = no_id;  ///< a keyframe's id; for `optimize_poses` an index
  std::uint32_t to = no_id;    ///< as `from`
  edge_kind kind = edge_kind::tree;
  std::uint32_t shared = 0;  ///< landmarks that both observe
  sim3 measurement;          ///< `T_from_to`; lengths at `from` are its scale times those at `to`
  double weight = 1.0;       ///< of its squared error
};

/// The edges of the spanning tree, the loop edges, and the pairs that share at least `threshold` landmarks; each pair
/// of keyframes once, by ascending `from`. Edges of the tree lead from child to parent, the others from the newer
/// keyframe to the older one. The measurements are the present relative poses. O(keyframes and pairs that share
/// landmarks).
template <feature_descriptor D>
[[nodiscard]] std::vector<essential_edge> essential_graph(const basic_map<D>& m, std::uint32_t threshold = 100) {
  std::vector<essential_edge> edges;
  for (const auto& k : m.keyframes()) {
    const auto add = [&](keyframe_id to, edge_kind kind) {
      edges.push_back({k.id.value(), to.value(), kind, m.covisibility().shared(k.id, to),
                       sim3(k.T_world_camera.inverse() * m.at(to).T_world_camera)});
    };
    const spanning_tree& tree = m.tree();
    const auto in_tree = [&](keyframe_id other) { return tree.parent(k.id) == other || tree.parent(other) == k.id; };
    const std::vector<keyframe_id>& loops = tree.loop_edges(k.id);
    if (tree.parent(k.id) != no_id) add(tree.parent(k.id), edge_kind::tree);
    for (const keyframe_id other : loops)
      if (other < k.id && !in_tree(other)) add(other, edge_kind::loop);
    for (const covisible& pair : m.covisibility().sharing(k.id)) {
      if (pair.keyframe > k.id) break;
      if (pair.shared >= threshold && !in_tree(pair.keyframe) &&
          !std::binary_search(loops.begin(), loops.end(), pair.keyframe))
        add(pair.keyframe, edge_kind::covisibility);
    }
  }
  return edges;
}

/// Moves poses such that they agree with the edges, whose ends are indices of them; those with a nonzero entry in
/// `is_fixed` stay. `scale_is_known`: all scales are and remain 1; otherwise scales are adjusted as well. Returns the
/// number of iterations; empty, and the poses are of no use, if it fails or `callback` cancels it.
[[nodiscard]] std::optional<int> optimize_poses(std::span<sim3> poses, const std::vector<essential_edge>& edges,
                                                std::span<const std::uint8_t> is_fixed, bool scale_is_known,
                                                int max_iterations, const progress& callback = {});

/// Optimises poses of type `T`. Their number is that of the vertices.
template <class T>
[[nodiscard]] std::optional<int> optimize_graph(std::span<T> poses, const std::vector<essential_edge>& edges,
                                                std::span<const std::uint8_t> is_fixed, int max_iterations,
                                                const progress& callback) {
  using square = matrix<T::dof, T::dof>;
  std::vector<optimize::pose_graph_edge<T>> measured;
  measured.reserve(edges.size());
  for (const essential_edge& e : edges) {
    const sim3& m = e.measurement;
    if constexpr (std::same_as<T, se3>)
      measured.push_back({e.from, e.to, se3(m.rotation(), m.translation()), square(e.weight * identity<square>())});
    else
      measured.push_back({e.from, e.to, m, square(e.weight * identity<square>())});
  }
  optimize::pose_graph_solver<T> solver;
  const auto summary =
      solver.solve(seq, poses, measured, {.max_iterations = max_iterations, .fixed = is_fixed}, callback);
  if (optimize::is_failure(summary.status) || summary.status == optimize::pose_graph_status::cancelled)
    return std::nullopt;
  return summary.iterations;
}

inline std::optional<int> optimize_poses(std::span<sim3> poses, const std::vector<essential_edge>& edges,
                                         std::span<const std::uint8_t> is_fixed, bool scale_is_known,
                                         int max_iterations, const progress& callback) {
  if (!scale_is_known) return optimize_graph<sim3>(poses, edges, is_fixed, max_iterations, callback);
  std::vector<se3> rigid;
  rigid.reserve(poses.size());
  for (const sim3& p : poses) rigid.emplace_back(p.rotation(), p.translation());
  const auto iterations = optimize_graph<se3>(rigid, edges, is_fixed, max_iterations, callback);
  for (std::size_t i = 0; i != poses.size(); ++i) poses[i] = sim3(rigid[i]);
  return iterations;
}

}  // namespace orbis::slam::detail

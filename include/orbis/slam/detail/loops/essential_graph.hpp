// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The essential graph: the few edges between keyframes over which the correction of a loop is distributed.
///
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM: a versatile and accurate monocular SLAM system",
/// T-RO 31 (2015), section III.D.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/sim3.hpp>
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

}  // namespace orbis::slam::detail

#ifndef ORBIS_COMPILED
#include <orbis/slam/detail/compiled/essential_graph_functions.hpp>
#endif

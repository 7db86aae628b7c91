// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The few edges that are enough to spread the correction of a loop over the keyframes.
///
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM: a versatile and accurate monocular SLAM system",
/// T-RO 31 (2015), section III.D.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string_view>
#include <vector>

#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
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

/// An edge between two keyframes, as pose graphs want it (`optimize::relative_measurement`): its ends index
/// `poses_of(map)`.
struct essential_edge {
  keyframe_id from = no_id;
  keyframe_id to = no_id;
  edge_kind kind = edge_kind::tree;
  std::uint32_t shared = 0;  ///< landmarks that both see
  se3 measurement;           ///< `T_from_to`, by the poses as they are
  matrix<6, 6> information = matrix<6, 6>::Identity();
};

/// The spanning tree, the loop edges, and the pairs that share at least `threshold` landmarks; each pair of keyframes
/// once, by ascending `from`: the tree's edges from child to parent, the others from the newer keyframe to the older
/// one. O(keyframes and pairs that share).
[[nodiscard]] inline std::vector<essential_edge> essential_graph(const map& m, std::uint32_t threshold = 100) {
  std::vector<essential_edge> edges;
  for (const keyframe& k : m.keyframes()) {
    const auto add = [&](keyframe_id to, edge_kind kind) {
      edges.push_back({k.id, to, kind, m.covisibility().shared(k.id, to),
                       k.T_world_camera.inverse() * m.at(to).T_world_camera, matrix<6, 6>::Identity()});
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

/// `T_world_camera` of every keyframe, by number; the identity where one was erased, which no edge touches.
[[nodiscard]] inline std::vector<se3> poses_of(const map& m) {
  std::vector<se3> poses(m.keyframe_end());
  for (const keyframe& k : m.keyframes()) poses[k.id] = k.T_world_camera;
  return poses;
}

}  // namespace orbis::slam::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Correction of a map after a loop closure: distributes the drift over the keyframes between the ends of the loop, and
/// fuses the landmarks at both ends.
///
/// `take` and `apply_poses` access the map; `solve` works on the snapshot. The essential graph with the new edge is
/// optimised as a pose graph; the root of the map is held fixed, and the other edges keep their measurements. Landmarks
/// follow the keyframes. Keyframes, landmarks and observations may be added between `take` and `apply_poses`: new
/// keyframes follow their parent.
///
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM: a versatile and accurate monocular SLAM system",
/// T-RO 31 (2015), sections VII.C and VII.D; if depth is measured, the poses have no scale. H. Strasdat, J. M. M.
/// Montiel, A. J. Davison, "Scale drift-aware large scale monocular SLAM", RSS 2010, for the scale if depth is not
/// measured.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/pose_graph.hpp>
#include <orbis/optimize/pose_graph_problem.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/loops/loop_fusion.hpp>
#include <orbis/slam/detail/loops/loop_verification.hpp>
#include <orbis/slam/detail/map/keyframe_motion.hpp>
#include <orbis/slam/detail/mapping/landmark_fusion.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

// The essential graph: the subset of edges between keyframes over which the correction of a loop is distributed.
//
// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM: a versatile and accurate monocular SLAM system",
// T-RO 31 (2015), section III.D.

enum class edge_kind { tree, loop, covisibility };

/// An edge of a pose graph.
struct essential_edge {
  std::uint32_t from = no_id;  ///< id of a keyframe; for `optimize_poses`, an index
  std::uint32_t to = no_id;    ///< like `from`
  edge_kind kind = edge_kind::tree;
  std::uint32_t shared = 0;  ///< number of landmarks that both keyframes observe
  sim3 measurement;          ///< `T_from_to`; its scale is the ratio of lengths at `from` to those at `to`
  double weight = 1.0;       ///< weight of the squared error
};

/// Returns the edges of the spanning tree, the loop edges, and the pairs that share at least `threshold` landmarks;
/// each pair of keyframes once, in ascending order of `from`. Tree edges lead from child to parent, other edges from
/// the newer keyframe to the older one. The measurements are the current relative poses. O(keyframes + pairs that share
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

/// Optimises poses of type `T`, one per vertex.
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

/// Optimises poses with respect to the edges, whose ends are indices into `poses`; poses with a nonzero entry in
/// `is_fixed` are held fixed. If `scale_is_known`, all scales are 1 and stay 1; otherwise scales are optimised as well.
/// Returns the number of iterations; empty, with unusable poses, on failure or if `callback` cancels.
template <class S = double>
[[nodiscard]] std::optional<int> optimize_poses(std::type_identity_t<std::span<basic_sim3<S>>> poses,
                                                const std::vector<essential_edge>& edges,
                                                std::span<const std::uint8_t> is_fixed, bool scale_is_known,
                                                int max_iterations, const progress& callback = {}) {
  if (!scale_is_known) return optimize_graph<basic_sim3<S>>(poses, edges, is_fixed, max_iterations, callback);
  std::vector<basic_se3<S>> rigid;
  rigid.reserve(poses.size());
  for (const basic_sim3<S>& p : poses) rigid.emplace_back(p.rotation(), p.translation());
  const auto iterations = optimize_graph<basic_se3<S>>(rigid, edges, is_fixed, max_iterations, callback);
  for (std::size_t i = 0; i != poses.size(); ++i) poses[i] = basic_sim3<S>(rigid[i]);
  return iterations;
}

}  // namespace orbis::slam::detail

namespace orbis::slam::detail::loop_correction {

/// The result of closing a loop.
struct report {
  bool corrected = false;
  double moved = 0.0;         ///< translation of the keyframe, metres
  double turned = 0.0;        ///< rotation of the keyframe, radians
  double scale = 1.0;         ///< factor by which lengths at the keyframe were scaled
  std::size_t keyframes = 0;  ///< number of corrected keyframes
  int iterations = 0;         ///< number of iterations of pose graph optimisation
};

template <feature_descriptor D>
struct snapshot {
  loop_match match;
  loop_fusion::snapshot<D> fusion;
  std::vector<keyframe_id> keyframes;
  std::vector<sim3> poses;  ///< pose of each keyframe of the snapshot
  std::vector<essential_edge> edges;
  std::vector<std::uint8_t> is_fixed;  ///< for each keyframe: 1 if its pose is held fixed
};

struct solution {
  std::vector<sim3> poses;  ///< pose of each keyframe of the snapshot
  std::vector<loop_fusion::pair> pairs;
  int iterations = 0;
};

/// Copies the data needed for the correction. Empty if a keyframe of the match no longer exists, or both are the same.
/// O(keyframes + pairs that share landmarks + features of the neighbourhood).
/// @pre both keyframes of the match are, or were, in this map
template <feature_descriptor D>
[[nodiscard]] std::optional<snapshot<D>> take(const basic_map<D>& m, const loop_match& match,
                                              const loop_correction_options& o = {}) {
  if (!m.has_keyframe(match.keyframe) || !m.has_keyframe(match.candidate) || match.keyframe == match.candidate)
    return std::nullopt;
  snapshot<D> s{match, loop_fusion::take(m, m, match, o.fusion), {}, {}, essential_graph(m, o.strong), {}};
  for (const auto& k : m.keyframes()) {
    s.keyframes.push_back(k.id);
    s.poses.emplace_back(k.T_world_camera);
    s.is_fixed.push_back(k.id == m.tree().root() ? 1 : 0);
  }
  const std::uint32_t a = match.keyframe.value(), b = match.candidate.value();
  std::erase_if(s.edges, [&](const essential_edge& e) {
    return e.kind == edge_kind::loop && std::min(e.from, e.to) == std::min(a, b) &&
           std::max(e.from, e.to) == std::max(a, b);
  });
  for (essential_edge& e : s.edges) {
    // The more landmarks two keyframes share, the better their relative pose is known. The edge of an earlier loop may
    // have been moved to keyframes that share few landmarks, although their neighbours share many: it keeps a minimum
    // weight.
    const std::uint32_t least = e.kind == edge_kind::loop ? std::max(1U, o.strong / 4) : 1U;
    e.weight *= static_cast<double>(std::clamp(e.shared, least, o.strong)) / o.strong;
  }
  s.edges.push_back(
      {b, a, edge_kind::loop, static_cast<std::uint32_t>(match.inliers), match.scaled_motion(), o.loop_weight});
  for (essential_edge& e : s.edges) {  // from ids to indices, because eventually most ids belong to erased keyframes
    const auto index_of = [&s](std::uint32_t id) {
      return static_cast<std::uint32_t>(std::lower_bound(s.keyframes.begin(), s.keyframes.end(), keyframe_id{id}) -
                                        s.keyframes.begin());
    };
    e.from = index_of(e.from);
    e.to = index_of(e.to);
  }
  return s;
}

/// Solves the correction. Empty if `callback(iteration, iterations)` returned false, or the pose graph cannot be
/// solved.
template <feature_descriptor D, camera::camera_model Camera>
[[nodiscard]] std::optional<solution> solve(const snapshot<D>& s, const camera_rig<Camera>& rig,
                                            const loop_correction_options& o = {}, const progress& callback = {}) {
  solution found{s.poses, loop_fusion::find_pairs(s.fusion, rig, o.fusion), 0};
  const auto iterations = optimize_poses(found.poses, s.edges, s.is_fixed, rig.scale_is_known, o.iterations, callback);
  if (!iterations) return std::nullopt;
  found.iterations = *iterations;
  return found;
}

/// Writes the poses of a solution to the map of the snapshot. The map is not corrected if an end of the loop was erased
/// without a replacement. If the report indicates that the map was corrected, the caller must then call
/// `loop_fusion::fuse` and `update_landmarks`.
template <feature_descriptor D>
report apply_poses(basic_map<D>& m, const snapshot<D>& s, const solution& solved) {
  report done;
  done.iterations = solved.iterations;
  const keyframe_motions motion = propagate_motion<D>(m, s.keyframes, solved.poses);
  const keyframe_id a = m.replacement(s.match.keyframe), b = m.replacement(s.match.candidate);
  if (a == no_id || b == no_id) return done;
  const se3 before = m.at(a).T_world_camera;
  move_all<D>(m, motion);
  if (a != b) m.add_loop_edge(a, b);
  done.corrected = true;
  done.keyframes = m.keyframes().size();
  done.moved = norm(m.at(a).T_world_camera.translation() - before.translation());
  done.scale = motion.at(a.value()).scale();
  done.turned = norm((before.rotation().inverse() * m.at(a).T_world_camera.rotation()).log());
  return done;
}

}  // namespace orbis::slam::detail::loop_correction

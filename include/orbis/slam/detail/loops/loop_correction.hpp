// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Closes a loop: distributes the drift over the keyframes between its ends, and fuses the landmarks of both ends.
///
/// `take` and `apply` touch the map, `solve` works on the snapshot. The essential graph with the new edge is optimised
/// as a pose graph; the root of the map is held, and the other edges keep their measurement. Landmarks follow the
/// keyframes. Between `take` and `apply` keyframes, landmarks and observations may be added: keyframes follow their
/// parent.
///
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM: a versatile and accurate monocular SLAM system",
/// T-RO 31 (2015), sections VII.C and VII.D; with depth, poses have no scale. H. Strasdat, J. M. M. Montiel, A. J.
/// Davison, "Scale drift-aware large scale monocular SLAM", RSS 2010, for the scale without depth.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/loops/essential_graph.hpp>
#include <orbis/slam/detail/loops/loop_fusion.hpp>
#include <orbis/slam/detail/loops/loop_verification.hpp>
#include <orbis/slam/detail/map/keyframe_motion.hpp>
#include <orbis/slam/detail/mapping/landmark_fusion.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail::loop_correction {

/// The result of closing a loop.
struct report {
  bool corrected = false;
  fusion_counts fusion;       ///< of landmarks
  double moved = 0.0;         ///< of the keyframe, metres
  double turned = 0.0;        ///< of the keyframe, radians
  double scale = 1.0;         ///< by how much lengths at the keyframe grew
  std::size_t keyframes = 0;  ///< that were corrected
  int iterations = 0;         ///< of the pose graph
};

template <feature_descriptor D>
struct snapshot {
  loop_match match;
  loop_fusion::snapshot<D> fusion;
  std::vector<keyframe_id> keyframes;
  std::vector<sim3> poses;  ///< by keyframe of the snapshot
  std::vector<essential_edge> edges;
  std::vector<std::uint8_t> is_fixed;  ///< by keyframe
};

struct solution {
  std::vector<sim3> poses;  ///< by keyframe of the snapshot
  std::vector<loop_fusion::pair> pairs;
  int iterations = 0;
};

/// Empty if a keyframe of the match is gone. O(keyframes, pairs that share landmarks, features of the neighbourhood).
/// @pre the match is one within the map
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
    // The more landmarks two keyframes share, the better their relative pose is known. But an edge of an earlier loop
    // may have passed on to keyframes that share few, although many of their neighbours do: it stays a tie.
    const std::uint32_t least = e.kind == edge_kind::loop ? std::max(1U, o.strong / 4) : 1U;
    e.weight *= static_cast<double>(std::clamp(e.shared, least, o.strong)) / o.strong;
  }
  s.edges.push_back(
      {b, a, edge_kind::loop, static_cast<std::uint32_t>(match.inliers), match.scaled_motion(), o.loop_weight});
  for (essential_edge& e : s.edges) {  // from ids to indices: in the end most ids are those of erased keyframes
    const auto index_of = [&s](std::uint32_t id) {
      return static_cast<std::uint32_t>(std::lower_bound(s.keyframes.begin(), s.keyframes.end(), keyframe_id{id}) -
                                        s.keyframes.begin());
    };
    e.from = index_of(e.from);
    e.to = index_of(e.to);
  }
  return s;
}

/// Empty if it was stopped (`callback(iteration, iterations)` returned false), or the graph cannot be solved.
template <feature_descriptor D, camera::camera_model Camera>
[[nodiscard]] std::optional<solution> solve(const snapshot<D>& s, const camera_rig<Camera>& rig,
                                            const loop_correction_options& o = {}, const progress& callback = {}) {
  solution found{s.poses, loop_fusion::find_pairs(s.fusion, rig, o.fusion), 0};
  const auto iterations = optimize_poses(found.poses, s.edges, s.is_fixed, rig.scale_is_known, o.iterations, callback);
  if (!iterations) return std::nullopt;
  found.iterations = *iterations;
  return found;
}

/// Writes the poses of a solution into the map that the snapshot was taken of. `loop_fusion::fuse`, then
/// `update_landmarks`, are left to the caller, if the report says that the map was corrected: it is not if no keyframe
/// stands for an end of the loop any more.
template <feature_descriptor D>
report apply_poses(basic_map<D>& m, const snapshot<D>& s, const solution& solved) {
  report done;
  done.iterations = solved.iterations;
  const keyframe_motions motion = propagate_motion<D>(m, s.keyframes, solved.poses);
  const keyframe_id a = m.replacement_of(s.match.keyframe), b = m.replacement_of(s.match.candidate);
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

/// As `apply_poses`, fuses landmarks, and updates all of them.
template <feature_descriptor D>
report apply(basic_map<D>& m, const snapshot<D>& s, const solution& solved) {
  report done = apply_poses(m, s, solved);
  if (!done.corrected) return done;
  done.fusion = loop_fusion::fuse<D>(m, solved.pairs);
  update_landmarks(m);
  return done;
}

/// Closes a loop at once. Nothing is changed unless the report says so.
template <feature_descriptor D, camera::camera_model Camera>
report close(basic_map<D>& m, const loop_match& match, const camera_rig<Camera>& rig,
             const loop_correction_options& o = {}) {
  const auto s = take(m, match, o);
  const auto solved = s ? solve(*s, rig, o) : std::nullopt;
  return solved ? apply(m, *s, *solved) : report{};
}

}  // namespace orbis::slam::detail::loop_correction

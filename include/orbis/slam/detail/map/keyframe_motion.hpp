// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Motion of keyframes together with their landmarks.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam::detail {

/// The motion of each keyframe in the world frame, `T_new_old`.
using keyframe_motions = std::unordered_map<std::uint32_t, sim3>;

/// Moves every keyframe `k` by `T_new_old[k]`, a motion in the world frame, and every landmark with the oldest keyframe
/// that observes it. Does not call `map.update_landmark`: see `update_landmarks`. O(map).
/// @pre there is a motion for every keyframe of the map
template <feature_descriptor D>
void move_all(basic_map<D>& m, const keyframe_motions& T_new_old) {
  for (const auto& l : m.landmarks()) m.move_landmark(l.id, T_new_old.at(l.observations.front().keyframe.value()));
  for (const auto& k : m.keyframes()) m.move_keyframe(k.id, T_new_old.at(k.id.value()));
}

/// Calls `map.update_landmark` for `count` landmarks starting at id `first`, or for all that are left. Returns the next
/// id, at most `landmark_end()`, from which a caller that shares the map can continue later. Until then, searches use
/// the old normals and distances of the remaining landmarks.
template <feature_descriptor D>
landmark_id update_landmarks(basic_map<D>& m, landmark_id first, std::size_t count) {
  landmark_id l = m.next_landmark(first);
  for (; count != 0 && l != m.landmark_end(); --count, l = m.next_landmark(l + 1)) m.update_landmark(l);
  return l;
}

/// Returns a keyframe and its neighbours in the covisibility graph.
template <feature_descriptor D>
[[nodiscard]] std::vector<keyframe_id> neighborhood(const basic_map<D>& m, keyframe_id k) {
  std::vector<keyframe_id> around{k};
  for (const covisible& n : m.covisibility().neighbors(k)) around.push_back(n.keyframe);
  return around;
}

/// Returns the motion of every keyframe of a map, given new poses of some of them; the scale of a new pose is the
/// factor by which the lengths in the keyframe's view change. The other keyframes move with their parents in the
/// spanning tree; their motion is the identity if no ancestor has a new pose. New poses of erased keyframes are
/// ignored. O(keyframes).
template <feature_descriptor D>
[[nodiscard]] keyframe_motions propagate_motion(const basic_map<D>& m, std::span<const keyframe_id> solved,
                                                std::span<const sim3> T_world_camera) {
  assert(solved.size() == T_world_camera.size());
  keyframe_motions motion;
  for (std::size_t i = 0; i != solved.size(); ++i) {
    const keyframe_id k = solved[i];
    if (m.has_keyframe(k)) motion[k.value()] = T_world_camera[i] * sim3(m.at(k).T_world_camera.inverse());
  }
  std::vector<keyframe_id> path;
  for (const auto& k : m.keyframes()) {
    path.clear();
    keyframe_id at = k.id;
    for (; at != no_id && !motion.contains(at.value()); at = m.tree().parent(at)) path.push_back(at);
    const sim3 with = at != no_id ? motion.at(at.value()) : sim3{};
    for (const keyframe_id follows : path) motion.emplace(follows.value(), with);
  }
  return motion;
}

}  // namespace orbis::slam::detail

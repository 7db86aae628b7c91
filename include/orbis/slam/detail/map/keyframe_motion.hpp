// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Moves keyframes, and landmarks along with them.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam::detail {

/// Moves every keyframe `k` by `T_new_old[k]`, a motion in the world, and every landmark with the oldest keyframe that
/// observes it. `map.update_landmark` is not called: see `update_landmarks`. O(map).
/// @pre T_new_old.size() == m.keyframe_end()
template <feature_descriptor D>
void move_all(basic_map<D>& m, std::span<const sim3> T_new_old) {
  assert(T_new_old.size() == m.keyframe_end().value());
  for (const auto& l : m.landmarks()) m.move_landmark(l.id, T_new_old[l.observations.front().keyframe.value()]);
  for (keyframe_id k = 0; k != m.keyframe_end(); ++k)
    if (m.has_keyframe(k)) m.move_keyframe(k, T_new_old[k.value()]);
}

/// Calls `map.update_landmark` for `count` landmarks from the id `first` on, or for all that are left. Returns the id
/// behind them, at most `landmark_end()`, so that a caller who shares the map can go on there later. Until then,
/// landmarks are searched for by their old normals and distances.
template <feature_descriptor D>
landmark_id update_landmarks(basic_map<D>& m, landmark_id first, std::size_t count) {
  landmark_id l = m.next_landmark(first);
  for (; count != 0 && l != m.landmark_end(); --count, l = m.next_landmark(l + 1)) m.update_landmark(l);
  return l;
}
template <feature_descriptor D>
void update_landmarks(basic_map<D>& m) {
  update_landmarks(m, 0, m.landmark_count());
}

/// A keyframe and its neighbours in the covisibility graph.
template <feature_descriptor D>
[[nodiscard]] std::vector<keyframe_id> neighborhood(const basic_map<D>& m, keyframe_id k) {
  std::vector<keyframe_id> around{k};
  for (const covisible& n : m.covisibility().neighbors(k)) around.push_back(n.keyframe);
  return around;
}

/// The motion of every keyframe of a map (`T_new_old`, in the world, by id), given new poses for some of them, with the
/// scale of the lengths in their views. The others move with their parent in the spanning tree. The identity where
/// there is no keyframe, and where no keyframe up to the root has a new pose. New poses of erased keyframes are
/// ignored. O(ids of keyframes).
template <feature_descriptor D>
[[nodiscard]] std::vector<sim3> propagate_motion(const basic_map<D>& m, std::span<const keyframe_id> solved,
                                                 std::span<const sim3> T_world_camera) {
  assert(solved.size() == T_world_camera.size());
  std::vector<sim3> motion(m.keyframe_end().value());
  std::vector<std::uint8_t> known(m.keyframe_end().value(), 0);
  for (std::size_t i = 0; i != solved.size(); ++i) {
    const keyframe_id k = solved[i];
    if (!m.has_keyframe(k)) continue;
    motion[k.value()] = T_world_camera[i] * sim3(m.at(k).T_world_camera.inverse());
    known[k.value()] = 1;
  }
  std::vector<keyframe_id> path;
  for (const auto& k : m.keyframes()) {
    path.clear();
    keyframe_id at = k.id;
    for (; at != no_id && known[at.value()] == 0; at = m.tree().parent(at)) path.push_back(at);
    for (const keyframe_id follows : path) {
      if (at != no_id) motion[follows.value()] = motion[at.value()];
      known[follows.value()] = 1;
    }
  }
  return motion;
}

}  // namespace orbis::slam::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Moving keyframes, and the landmarks along with them.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <numeric>
#include <span>
#include <vector>

#include <orbis/core/se3.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/tally.hpp>

namespace orbis::slam {

/// Puts keyframes where `T_world_camera` says, entry by entry. Every landmark that one of them sees moves rigidly with
/// the oldest of these, once; all others stay. Where the keyframes do not move alike, `map.update` of the landmarks is
/// the caller's to call, or of adjustment. O(landmarks seen).
/// @pre the keyframes are there, each named once
inline void move_keyframes(map& m, std::span<const keyframe_id> keyframes, std::span<const se3> T_world_camera) {
  assert(keyframes.size() == T_world_camera.size());
  std::vector<std::size_t> by_age(keyframes.size());
  std::iota(by_age.begin(), by_age.end(), std::size_t{0});
  std::sort(by_age.begin(), by_age.end(), [&](std::size_t a, std::size_t b) { return keyframes[a] < keyframes[b]; });
  tally moved;
  for (const std::size_t i : by_age) {
    const keyframe& k = m.at(keyframes[i]);
    const se3 T_new_old = T_world_camera[i] * k.T_world_camera.inverse();
    for (const landmark_id l : k.landmarks)
      if (l != no_id && moved.add(l)) m.move_landmark(l, T_new_old);
    m.set_pose(k.id, T_world_camera[i]);
  }
}

/// Moves keyframes, and the landmarks that they see, by the same motion in the world; all others stay.
/// @pre the keyframes are there, each named once
inline void transform(map& m, std::span<const keyframe_id> keyframes, const se3& T_new_old) {
  tally moved;
  for (const keyframe_id k : keyframes) {
    for (const landmark_id l : m.at(k).landmarks)
      if (l != no_id && moved.add(l)) m.move_landmark(l, T_new_old);
    m.set_pose(k, T_new_old * m.at(k).T_world_camera);
  }
}

/// Another frame of reference for the whole map.
inline void transform(map& m, const se3& T_new_old) { m.transform(T_new_old); }

/// A keyframe and its neighbours in the covisibility graph: what moves at once when a loop is closed.
[[nodiscard]] inline std::vector<keyframe_id> neighborhood(const map& m, keyframe_id k) {
  std::vector<keyframe_id> around{k};
  for (const covisible& n : m.covisibility().neighbors(k)) around.push_back(n.keyframe);
  return around;
}

}  // namespace orbis::slam

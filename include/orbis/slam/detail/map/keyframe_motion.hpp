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
#include <orbis/slam/detail/map/counter.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam::detail {

/// Puts keyframes where `T_world_camera` says, entry by entry. Every landmark that one of them sees moves rigidly with
/// the oldest of these, once; all others stay. Where the keyframes do not move alike, `map.update` of the landmarks is
/// the caller's to call, or of adjustment. O(landmarks seen).
/// @pre the keyframes are there, each named once
inline void move_keyframes(map& m, std::span<const keyframe_id> keyframes, std::span<const se3> T_world_camera) {
  assert(keyframes.size() == T_world_camera.size());
  std::vector<std::size_t> by_age(keyframes.size());
  std::iota(by_age.begin(), by_age.end(), std::size_t{0});
  std::sort(by_age.begin(), by_age.end(), [&](std::size_t a, std::size_t b) { return keyframes[a] < keyframes[b]; });
  counter moved;
  for (const std::size_t i : by_age) {
    const keyframe& k = m.at(keyframes[i]);
    const se3 T_new_old = T_world_camera[i] * k.T_world_camera.inverse();
    for (const landmark_id l : k.landmarks)
      if (l != no_id && moved.add(l)) m.move_landmark(l, T_new_old);
    m.set_pose(k.id, T_world_camera[i]);
  }
}

/// Moves every keyframe by its own motion in the world, by number, and every landmark with the oldest keyframe that
/// sees it. `map.update` of the landmarks is the caller's to call: see `update_landmarks`. O(map), and much quicker
/// than `move_keyframes` of all. @pre T_new_old.size() == m.keyframe_end()
inline void move_all(map& m, std::span<const se3> T_new_old) {
  assert(T_new_old.size() == m.keyframe_end());
  for (landmark_id l = 0; l != m.landmark_end(); ++l)
    if (m.has_landmark(l)) m.move_landmark(l, T_new_old[m.landmark_at(l).observations.front().keyframe]);
  for (keyframe_id k = 0; k != m.keyframe_end(); ++k)
    if (m.has_keyframe(k)) m.set_pose(k, T_new_old[k] * m.at(k).T_world_camera);
}

/// Calls `map.update` for those of `count` landmarks from number `first` on that there are; false if none follow.
/// Whoever shares the map may do this part by part: until then landmarks are looked for by what they were like before.
inline bool update_landmarks(map& m, landmark_id first, landmark_id count) {
  const landmark_id end = first + std::min(count, m.landmark_end() - std::min(first, m.landmark_end()));
  for (landmark_id l = first; l < end; ++l)
    if (m.has_landmark(l)) m.update(l);
  return end < m.landmark_end();
}

/// Moves keyframes, and the landmarks that they see, by the same motion in the world; all others stay.
/// @pre the keyframes are there, each named once
inline void transform(map& m, std::span<const keyframe_id> keyframes, const se3& T_new_old) {
  counter moved;
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

}  // namespace orbis::slam::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What was solved on a copy of a map, brought to what the map has become since.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/core/se3.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam::detail {

/// How every keyframe of a map moves, where poses are known for some of them: `T_new_old`, a motion in the world, by
/// number. The others move with their parent in the tree, so that they keep their place among those around them. The
/// identity where there is no keyframe, and where nothing up to the root has a pose; poses of keyframes that are gone
/// are ignored. O(keyframes ever).
[[nodiscard]] inline std::vector<se3> carried_motion(const map& m, std::span<const keyframe_id> solved,
                                                     std::span<const se3> T_world_camera) {
  assert(solved.size() == T_world_camera.size());
  std::vector<se3> motion(m.keyframe_end());
  std::vector<std::uint8_t> known(m.keyframe_end(), 0);
  for (std::size_t i = 0; i != solved.size(); ++i) {
    const keyframe_id k = solved[i];
    if (!m.has_keyframe(k)) continue;
    motion[k] = T_world_camera[i] * m.at(k).T_world_camera.inverse();
    known[k] = 1;
  }
  std::vector<keyframe_id> path;
  for (const keyframe& k : m.keyframes()) {
    path.clear();
    keyframe_id at = k.id;
    for (; at != no_id && known[at] == 0; at = m.tree().parent(at)) path.push_back(at);
    for (const keyframe_id follows : path) {
      if (at != no_id) motion[follows] = motion[at];
      known[follows] = 1;
    }
  }
  return motion;
}

}  // namespace orbis::slam::detail

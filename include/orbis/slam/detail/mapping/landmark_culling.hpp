// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Which landmarks the map drops again.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/slam/detail/map/local_map.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

/// How well a landmark is founded: its observations, those with depth counted twice.
[[nodiscard]] inline std::uint32_t support(const map& m, const landmark& l) {
  std::uint32_t sum = 0;
  for (const observation& o : l.observations) sum += m.at(o.keyframe).has_depth(o.feature) ? 2 : 1;
  return sum;
}

/// Whether a landmark proved useless by the time of keyframe `newest`: seldom found where it should be seen, or hardly
/// seen again by the keyframes that followed its own. Those of the newest keyframe get their chance.
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM", T-RO 31 (2015), section VI.B.
[[nodiscard]] inline bool is_useless(const map& m, const landmark& l, keyframe_id newest, const culling_options& o) {
  if (l.created >= newest) return false;
  if (l.visible >= o.min_visible && static_cast<double>(l.found) < o.found_ratio * static_cast<double>(l.visible))
    return true;
  const keyframe_id age = newest - l.created;
  return age >= o.age && age <= o.age + 1 && support(m, l) < o.min_support;
}

/// Drops the useless ones of the landmarks that the last keyframes see, and the neighbours of the newest. To be called
/// after each keyframe; what it costs depends on these alone. Returns how many went.
inline std::size_t cull_landmarks(map& m, keyframe_id newest, const culling_options& o) {
  std::vector<keyframe_id> around;
  for (keyframe_id k = newest - std::min(newest, o.age + 1); k <= newest; ++k)
    if (m.has_keyframe(k)) around.push_back(k);
  for (const covisible& n : m.covisibility().neighbors(newest, o.neighborhood))
    if (n.keyframe + o.age + 1 < newest) around.push_back(n.keyframe);
  std::size_t dropped = 0;
  for (const landmark_id l : landmarks_of(m, around)) {
    if (!is_useless(m, m.landmark_at(l), newest, o)) continue;
    m.remove_landmark(l);
    ++dropped;
  }
  return dropped;
}

}  // namespace orbis::slam::detail

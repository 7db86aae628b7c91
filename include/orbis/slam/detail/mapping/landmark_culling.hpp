// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Removes landmarks that proved unreliable.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/slam/detail/map/local_map.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

/// The number of observations of a landmark; those with depth count twice. O(observations).
template <feature_descriptor D>
[[nodiscard]] std::uint32_t support(const basic_map<D>& m, const basic_landmark<D>& l) {
  std::uint32_t sum = 0;
  for (const observation& o : l.observations) sum += m.at(o.keyframe).has_depth(o.feature) ? 2 : 1;
  return sum;
}

/// Whether a landmark is unreliable at the time of keyframe `newest`: seldom found where it is expected, or hardly
/// observed by the keyframes after the one that created it. Landmarks of the newest keyframe never are.
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM", T-RO 31 (2015), section VI.B.
template <feature_descriptor D>
[[nodiscard]] bool is_unreliable(const basic_map<D>& m, const basic_landmark<D>& l, keyframe_id newest,
                                 const culling_options& o) {
  if (l.created >= newest) return false;
  if (l.visible >= o.min_visible && static_cast<double>(l.found) < o.found_ratio * static_cast<double>(l.visible))
    return true;
  const std::uint32_t age = newest - l.created;
  if (age >= o.age && o.least_support != 0 && support(m, l) < o.least_support) return true;
  return age >= o.age && age <= o.age + 1 && support(m, l) < o.min_support;
}

/// Removes the unreliable landmarks among those that the last keyframes and the neighbours of the newest one observe.
/// To be called after each keyframe. Returns how many were removed. O(observations of these keyframes).
template <feature_descriptor D>
std::size_t cull_landmarks(basic_map<D>& m, keyframe_id newest, const culling_options& o) {
  std::vector<keyframe_id> around;
  for (keyframe_id k = newest - std::min(newest, keyframe_id{o.age + 1}).value(); k <= newest; ++k)
    if (m.has_keyframe(k)) around.push_back(k);
  for (const covisible& n : m.covisibility().neighbors(newest, o.neighborhood))
    if (n.keyframe + (o.age + 1) < newest) around.push_back(n.keyframe);
  std::size_t removed = 0;
  for (const landmark_id l : landmarks_of(m, around)) {
    if (!is_unreliable(m, m.landmark_at(l), newest, o)) continue;
    m.remove_landmark(l);
    ++removed;
  }
  return removed;
}

}  // namespace orbis::slam::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Removes landmarks that proved unreliable, and erases redundant keyframes.
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
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

/// Whether enough of a keyframe's landmarks that are closer than `close_depth` (metres; infinite: all, where no depth
/// is measured) are observed by enough other keyframes at the same or a finer pyramid level. False for a keyframe
/// without close landmarks. O(observations of its landmarks). Source: R. Mur-Artal, J. D. Tardos, "ORB-SLAM2", T-RO 33
/// (2017), section III.C, after ORB-SLAM (2015), VI.E.
template <feature_descriptor D>
[[nodiscard]] bool is_redundant(const basic_map<D>& m, keyframe_id id, double close_depth, const culling_options& o) {
  const auto& k = m.at(id);
  const bool needs_depth = std::isfinite(close_depth);
  std::size_t close = 0, seen_by_others = 0;
  for (std::uint32_t i = 0; i < k.size(); ++i) {
    if (k.landmarks[i] == no_id) continue;
    if (needs_depth && (!k.has_depth(i) || static_cast<double>(k.depth[i]) > close_depth)) continue;
    ++close;
    const int coarsest = k.features.keypoints[i].octave + o.coarser_levels;
    std::size_t others = 0;
    for (const observation& seen : m.landmark_at(k.landmarks[i]).observations)
      others += seen.keyframe != id && m.at(seen.keyframe).features.keypoints[seen.feature].octave <= coarsest;
    seen_by_others += others >= o.redundant_observers;
  }
  return close != 0 && static_cast<double>(seen_by_others) >= o.redundant * static_cast<double>(close);
}

/// Keeps no keyframe.
struct keep_none {
  [[nodiscard]] constexpr bool operator()(keyframe_id) const noexcept { return false; }
};

/// Erases the redundant neighbours of keyframe `newest`, the strongest first; each is judged after the ones before it
/// were erased. Kept are the root and those for which `keep(id)` is true. Keyframes with loop edges are erased like
/// others, and their edges pass to the replacement (ORB-SLAM keeps such keyframes: a map that closes loops for days
/// would grow by two keyframes for each). Returns the erased ones.
template <feature_descriptor D, std::predicate<keyframe_id> Keep = keep_none>
std::vector<keyframe_id> cull_keyframes(basic_map<D>& m, keyframe_id newest, double close_depth,
                                        const culling_options& o, Keep&& keep = {}) {
  std::vector<keyframe_id> erased;
  for (const covisible& n : m.covisibility().neighbors(newest, o.neighborhood)) {
    const keyframe_id k = n.keyframe;
    if (k == m.tree().root() || keep(k)) continue;
    if (!is_redundant(m, k, close_depth, o)) continue;
    m.erase_keyframe(k);
    erased.push_back(k);
  }
  return erased;
}

}  // namespace orbis::slam::detail

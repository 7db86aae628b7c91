// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The local map of a frame: the keyframes around it and their landmarks.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/slam/detail/map/counter.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam::detail {

/// Returns the keyframe that shares the most landmarks with a frame; `otherwise` if none shares any.
template <feature_descriptor D>
[[nodiscard]] keyframe_id most_shared(const basic_map<D>& m, const basic_frame<D>& f, keyframe_id otherwise) {
  const auto order = m.observers(f.landmarks);
  return order.empty() ? otherwise : order.front().keyframe;
}

/// Returns the median; changes the order of the values. @pre !values.empty()
[[nodiscard]] inline double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Returns the median depth of the landmarks that a frame observes, in the unit of the map; 0 if it observes none.
/// O(keypoints).
template <feature_descriptor D>
[[nodiscard]] double median_depth(const basic_map<D>& m, const basic_frame<D>& f) {
  const se3 T_camera_world = f.T_world_camera.inverse();
  std::vector<double> depths;
  for (const landmark_id l : f.landmarks)
    if (l != no_id && m.has_landmark(l)) depths.push_back((T_camera_world * m.landmark_at(l).position).z());
  return depths.empty() ? 0.0 : median(depths);
}

/// Returns the keyframes around a frame, at most `limit`: the reference, the keyframes that share landmarks with the
/// frame (in descending order of the number shared), then neighbours of the first five of these in the covisibility
/// graph and in the spanning tree. The cost depends on the observations of the frame's landmarks and on these
/// neighbours, not on the size of the map.
template <feature_descriptor D>
[[nodiscard]] std::vector<keyframe_id> local_keyframes(const basic_map<D>& m, const basic_frame<D>& f,
                                                       keyframe_id reference, std::size_t limit) {
  counter<keyframe_id> taken;
  std::vector<keyframe_id> around;
  const auto take = [&](keyframe_id k) {
    if (k != no_id && around.size() < limit && taken.add(k)) around.push_back(k);
  };
  take(m.replacement(reference));
  for (const covisible& c : m.observers(f.landmarks)) take(c.keyframe);
  constexpr std::size_t nearest = 5, neighbors = 10;
  const std::size_t first = std::min(nearest, around.size());
  for (std::size_t i = 0; i < first && around.size() < limit; ++i) {
    const keyframe_id k = around[i];
    for (const covisible& n : m.covisibility().neighbors(k, neighbors)) take(n.keyframe);
    take(m.tree().parent(k));
    for (const keyframe_id child : m.tree().children(k)) take(child);
  }
  return around;
}

/// Sorts ids in ascending order and removes repeated ones. O(n) if the ids are dense; otherwise O(n log n).
inline void sort_unique(std::vector<landmark_id>& ids) {
  if (ids.empty()) return;
  const auto [low, high] = std::minmax_element(ids.begin(), ids.end());
  const landmark_id first = *low;
  const std::size_t words = (*high - first) / 64 + 1;
  if (words > ids.size()) {
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    return;
  }
  std::vector<std::uint64_t> seen(words);  // one bit for each id
  for (const landmark_id id : ids) seen[(id - first) / 64] |= std::uint64_t{1} << ((id - first) % 64);
  ids.clear();
  for (std::uint32_t w = 0; w != words; ++w)
    for (std::uint64_t bits = seen[w]; bits != 0; bits &= bits - 1)
      ids.push_back(first + 64 * w + static_cast<std::uint32_t>(std::countr_zero(bits)));
}

/// Returns the landmarks that these keyframes observe, each once, in ascending order.
template <feature_descriptor D>
[[nodiscard]] std::vector<landmark_id> observed_landmarks(const basic_map<D>& m,
                                                          const std::vector<keyframe_id>& keyframes) {
  std::vector<landmark_id> all;
  for (const keyframe_id k : keyframes)
    for (const landmark_id l : m.at(k).landmarks)
      if (l != no_id) all.push_back(l);
  sort_unique(all);
  return all;
}

/// Returns the landmarks of `local_keyframes`.
template <feature_descriptor D>
[[nodiscard]] std::vector<landmark_id> local_landmarks(const basic_map<D>& m, const basic_frame<D>& f,
                                                       keyframe_id reference, std::size_t limit) {
  return observed_landmarks(m, local_keyframes(m, f, reference, limit));
}

}  // namespace orbis::slam::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The part of the map that a frame may show.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/slam/detail/map/counter.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam::detail {

/// The keyframe that shares the most landmarks with a frame; `otherwise` if none shares any.
[[nodiscard]] inline keyframe_id most_shared(const map& m, const frame& f, keyframe_id otherwise) {
  const auto order = m.sharing(f.landmarks);
  return order.empty() ? otherwise : order.front().first;
}

/// The keyframes around a frame: the reference, those that share landmarks with the frame, most first, then the
/// neighbours in both graphs of the nearest of these; at most `limit`. Costs what the frame's landmarks are seen and
/// what neighbours there are, whatever the size of the map.
[[nodiscard]] inline std::vector<keyframe_id> local_keyframes(const map& m, const frame& f, keyframe_id reference,
                                                              std::size_t limit) {
  counter taken;
  std::vector<keyframe_id> around;
  const auto take = [&](keyframe_id k) {
    if (k != no_id && around.size() < limit && taken.add(k)) around.push_back(k);
  };
  take(m.heir(reference));
  for (const auto& [k, shared] : m.sharing(f.landmarks)) take(k);
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

/// The landmarks of these keyframes, each once, in ascending order.
[[nodiscard]] inline std::vector<landmark_id> landmarks_of(const map& m, const std::vector<keyframe_id>& keyframes) {
  counter seen;
  std::vector<landmark_id> all;
  for (const keyframe_id k : keyframes)
    for (const landmark_id l : m.at(k).landmarks)
      if (l != no_id && seen.add(l)) all.push_back(l);
  std::sort(all.begin(), all.end());
  return all;
}

[[nodiscard]] inline std::vector<landmark_id> local_landmarks(const map& m, const frame& f, keyframe_id reference,
                                                              std::size_t limit) {
  return landmarks_of(m, local_keyframes(m, f, reference, limit));
}

}  // namespace orbis::slam::detail

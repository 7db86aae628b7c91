// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The part of the map that a frame may show.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/slam/map.hpp>

namespace orbis::slam {

/// The keyframe that shares the most landmarks with a frame; `otherwise` if none shares any.
[[nodiscard]] inline keyframe_id most_shared(const map& m, const frame& f, keyframe_id otherwise) {
  const auto order = m.sharing(f.landmarks);
  return order.empty() ? otherwise : order.front().first;
}

/// The keyframes around a frame: those that share landmarks with it, then the neighbours of the
/// nearest of these, then the reference; at most `limit`.
[[nodiscard]] inline std::vector<keyframe_id> local_keyframes(const map& m, const frame& f, keyframe_id reference,
                                                              std::size_t limit) {
  std::vector<std::uint8_t> taken(m.keyframes().size(), 0);
  std::vector<keyframe_id> around;
  const auto take = [&](keyframe_id k) {
    if (taken[k] != 0 || around.size() >= limit) return;
    taken[k] = 1;
    around.push_back(k);
  };
  take(reference);
  const auto direct = m.sharing(f.landmarks);
  for (const auto& [k, shared] : direct) take(k);
  constexpr std::size_t nearest = 5, neighbors = 10;
  const std::size_t first = std::min(nearest, around.size());
  for (std::size_t i = 0; i < first; ++i) {
    const auto second = m.sharing(m.at(around[i]).landmarks);
    for (std::size_t j = 0; j < std::min(neighbors, second.size()); ++j) take(second[j].first);
  }
  return around;
}

/// The landmarks of these keyframes, each once, in ascending order.
[[nodiscard]] inline std::vector<landmark_id> landmarks_of(const map& m, const std::vector<keyframe_id>& keyframes) {
  std::vector<landmark_id> all;
  for (const keyframe_id k : keyframes)
    for (const landmark_id l : m.at(k).landmarks)
      if (l != no_id) all.push_back(l);
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

[[nodiscard]] inline std::vector<landmark_id> local_landmarks(const map& m, const frame& f, keyframe_id reference,
                                                              std::size_t limit) {
  return landmarks_of(m, local_keyframes(m, f, reference, limit));
}

}  // namespace orbis::slam

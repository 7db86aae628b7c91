// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How the map grows: keyframes, and the landmarks their depth gives.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

/// Keypoints with depth that show no landmark, the nearest first: all close ones, and at least
/// `min_new_landmarks` if there are as many.
[[nodiscard]] inline std::vector<std::uint32_t> new_landmark_keypoints(const frame& f, const options& o) {
  std::vector<std::uint32_t> with_depth;
  for (std::uint32_t i = 0; i < f.size(); ++i)
    if (f.has_depth(i) && f.landmarks[i] == no_id) with_depth.push_back(i);
  std::stable_sort(with_depth.begin(), with_depth.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return f.depth[a] < f.depth[b]; });
  const auto far = std::find_if(with_depth.begin(), with_depth.end(),
                                [&](std::uint32_t i) { return static_cast<double>(f.depth[i]) > o.close_depth; });
  const auto close = static_cast<std::size_t>(far - with_depth.begin());
  with_depth.resize(std::min(with_depth.size(), std::max(close, o.min_new_landmarks)));
  return with_depth;
}

/// Makes a keyframe of a frame: it observes the landmarks that the frame shows, and its remaining
/// depth becomes new ones.
inline keyframe_id insert_keyframe(map& m, frame f, const options& o) {
  const keyframe_id id = m.add_keyframe(std::move(f));
  for (const landmark_id l : m.at(id).landmarks)
    if (l != no_id) m.update(l);
  for (const std::uint32_t i : new_landmark_keypoints(m.at(id), o)) m.add_landmark(id, i);
  return id;
}

}  // namespace orbis::slam::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Insertion of a frame into a map as a keyframe, with landmarks from its depth.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

/// Returns the keypoints that become landmarks: keypoints with depth that observe no landmark yet, the nearest first;
/// all that are closer than `o.close_depth`, and at least `o.min_new_landmarks` if available.
template <feature_descriptor D>
[[nodiscard]] std::vector<std::uint32_t> new_landmark_keypoints(const basic_frame<D>& f, const options& o) {
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

/// Adds a frame as a keyframe that observes `f.landmarks`, and adds landmarks at `new_landmark_keypoints`. Returns the
/// keyframe's id.
template <feature_descriptor D>
keyframe_id insert_keyframe(basic_map<D>& m, basic_frame<D> f, const options& o) {
  f.as_read = {};  // the map does not use row times
  const keyframe_id id = m.add_keyframe(std::move(f));
  for (const landmark_id l : m.at(id).landmarks)
    if (l != no_id) m.update_landmark(l);
  for (const std::uint32_t i : new_landmark_keypoints<D>(m.at(id), o))
    if (m.landmark_ids_left() != 0) m.add_landmark(id, i);
  return id;
}

}  // namespace orbis::slam::detail

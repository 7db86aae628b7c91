// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Which keyframes the map can do without.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

/// Whether enough of the close landmarks of a keyframe are seen as well or better by enough others. One that sees no
/// close landmark is not redundant. O(observations of its landmarks).
/// Source: R. Mur-Artal, J. D. Tardos, "ORB-SLAM2", T-RO 33 (2017), section III.C, after ORB-SLAM (2015), VI.E.
[[nodiscard]] inline bool is_redundant(const map& m, keyframe_id id, double close_depth, const culling_options& o) {
  const keyframe& k = m.at(id);
  std::size_t close = 0, seen_by_others = 0;
  for (std::uint32_t i = 0; i < k.size(); ++i) {
    if (k.landmarks[i] == no_id || !k.has_depth(i) || static_cast<double>(k.depth[i]) > close_depth) continue;
    ++close;
    const int coarsest = k.features.keypoints[i].octave + o.coarser_levels;
    std::size_t others = 0;
    for (const observation& seen : m.landmark_at(k.landmarks[i]).observations)
      others += seen.keyframe != id && m.at(seen.keyframe).features.keypoints[seen.feature].octave <= coarsest;
    seen_by_others += others >= o.redundant_observers;
  }
  return close != 0 && static_cast<double>(seen_by_others) >= o.redundant * static_cast<double>(close);
}

struct keep_none {
  [[nodiscard]] constexpr bool operator()(keyframe_id) const noexcept { return false; }
};

/// Erases the redundant neighbours of keyframe `newest`, the strongest first, each judged by what is left: not those
/// that `keep(id)` asks to keep, nor the root, nor those at which a loop was closed. Returns the erased ones.
template <std::predicate<keyframe_id> Keep = keep_none>
std::vector<keyframe_id> cull_keyframes(map& m, keyframe_id newest, double close_depth, const culling_options& o,
                                        Keep&& keep = {}) {
  std::vector<keyframe_id> erased;
  for (const covisible& n : m.covisibility().neighbors(newest, o.neighborhood)) {
    const keyframe_id k = n.keyframe;
    if (k == m.tree().root() || !m.tree().loop_edges(k).empty() || keep(k)) continue;
    if (!is_redundant(m, k, close_depth, o)) continue;
    m.erase_keyframe(k);
    erased.push_back(k);
  }
  return erased;
}

}  // namespace orbis::slam::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A point of the world, and what tells it from others.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/core/types.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/hamming.hpp>
#include <orbis/slam/ids.hpp>

namespace orbis::slam {

/// A keypoint that shows a landmark.
struct observation {
  keyframe_id keyframe = no_id;
  std::uint32_t feature = 0;
  friend bool operator==(const observation&, const observation&) = default;
};

struct landmark {
  landmark_id id = no_id;
  vec3 position = vec3::Zero();                 ///< in the world, metres
  vec3 normal = vec3::Zero();                   ///< mean direction towards the keyframes that see it, unit length
  features::binary_descriptor<256> descriptor;  ///< the most typical of those observed
  double min_distance = 0.0;                    ///< from which a keypoint at the coarsest level shows it, metres
  double max_distance = 0.0;                    ///< the same at the finest level
  std::vector<observation> observations;        ///< in ascending order of keyframe
  keyframe_id created = no_id;
  std::uint32_t visible = 0;            ///< frames that should have shown it
  std::uint32_t found = 0;              ///< frames that did
  bool has_current_descriptor = false;  ///< whether it is that of the observations as they are now

  /// The observation by a keyframe, or null. O(log observations).
  [[nodiscard]] const observation* seen_by(keyframe_id k) const noexcept {
    const auto at = std::lower_bound(observations.begin(), observations.end(), k,
                                     [](const observation& o, keyframe_id id) { return o.keyframe < id; });
    return at != observations.end() && at->keyframe == k ? &*at : nullptr;
  }
};

/// Which of `count` descriptors (`of(i)`) is the most typical: the one whose median distance to the others is least,
/// the first of those where equal. With more than 16 of them, of 16 spread evenly, so that the cost is bounded.
/// @pre count > 0
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM", T-RO 31 (2015), section III.C.
template <class Of>
[[nodiscard]] std::size_t most_typical(std::size_t count, Of&& of) {
  constexpr std::size_t most = 16;
  const std::size_t n = std::min(count, most);
  if (n < 3) return count - 1;
  const auto original = [&](std::size_t i) { return i * (count - 1) / (n - 1); };
  std::array<std::array<std::uint32_t, most>, most> distances{};
  for (std::size_t i = 0; i != n; ++i)
    for (std::size_t j = 0; j != i; ++j)
      distances[i][j] = distances[j][i] = features::hamming{}(of(original(i)), of(original(j)));
  std::size_t best = 0;
  std::uint32_t best_median = std::numeric_limits<std::uint32_t>::max();
  for (std::size_t i = 0; i != n; ++i) {
    const auto row = distances[i].begin();
    const auto middle = row + static_cast<std::ptrdiff_t>(n / 2);
    std::nth_element(row, middle, row + static_cast<std::ptrdiff_t>(n));
    if (*middle < best_median) {
      best_median = *middle;
      best = i;
    }
  }
  return original(best);
}

}  // namespace orbis::slam

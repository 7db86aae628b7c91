// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A point of the world, and what tells it from others.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include <orbis/core/types.hpp>
#include <orbis/features/descriptor.hpp>
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

}  // namespace orbis::slam

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A landmark: a 3D point of a map with its observations.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include <orbis/core/types.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/slam/extractor.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/landmark_patch.hpp>

namespace orbis::slam {

/// A keypoint of a keyframe that observes a landmark.
struct observation {
  keyframe_id keyframe;
  std::uint32_t feature = 0;  ///< index of the keypoint
  friend constexpr bool operator==(const observation&, const observation&) = default;
};

/// A point in the world with a descriptor of type `D`.
template <feature_descriptor D>
struct basic_landmark {
  landmark_id id;
  vec3 position = zeros<vec3>();          ///< in the world frame, metres
  vec3 normal = zeros<vec3>();            ///< mean direction towards the keyframes that observe it, unit length
  D descriptor{};                         ///< the most typical descriptor among its observations
  double min_distance = 0.0;              ///< distance at which it appears at the coarsest pyramid level, metres
  double max_distance = 0.0;              ///< distance at which it appears at the finest pyramid level, metres
  std::vector<observation> observations;  ///< in ascending order of keyframe; at most one per keyframe
  keyframe_id created;                    ///< the keyframe that created it
  landmark_patch patch;                   ///< not stored in map files
  std::uint32_t visible = 0;              ///< number of frames in which it was expected
  std::uint32_t found = 0;                ///< number of frames in which it was found
  bool has_current_descriptor = false;    ///< true if `descriptor` was chosen from the current observations

  /// Returns the observation by a keyframe, or null. O(log observations).
  [[nodiscard]] const observation* seen_by(keyframe_id k) const noexcept {
    const auto at = std::lower_bound(observations.begin(), observations.end(), k,
                                     [](const observation& o, keyframe_id id) { return o.keyframe < id; });
    return at != observations.end() && at->keyframe == k ? &*at : nullptr;
  }
};

/// A landmark with an ORB descriptor.
using landmark = basic_landmark<features::binary_descriptor<256>>;

}  // namespace orbis::slam

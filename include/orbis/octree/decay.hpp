// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Decay: how the value of a voxel changes with the time since it was observed. What was seen long ago may have moved
/// away; its voxels fade towards unknown and become unknown in the end.
///
/// A policy is a pure function of a voxel's value, so that a map may apply it once for each distinct value
/// (`occupancy_octree::transform`). Write your own to decay in another way, or to forget: empty is unknown.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>

#include <orbis/core/rounded.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::octree {

/// Where a value comes to rest: log-odds 0, or the value nearest to it that has the same state.
template <sensor_model M>
[[nodiscard]] inline typename M::value_type resting_value(typename M::value_type v) noexcept {
  using T = typename M::value_type;
  if (is_occupied<M>(v)) return std::max(T{0}, M::occupancy_threshold);
  return M::occupancy_threshold > 0 ? T{0} : largest_free_value<M>();
}

/// Log-odds halve in every `half_life`. Applying it twice is applying it once for the sum of the times,
/// but for rounding. Free never turns into occupied, nor back.
/// @pre half_life > 0, elapsed >= 0
template <sensor_model M = log_odds<>>
struct exponential_decay {
  double half_life = 60.0;  ///< seconds
  double elapsed = 1.0;     ///< since the last time, seconds

  [[nodiscard]] typename M::value_type operator()(typename M::value_type v) const noexcept {
    assert(half_life > 0.0 && elapsed >= 0.0);
    const auto rest = resting_value<M>(v);
    const double distance = static_cast<double>(v) - static_cast<double>(rest);
    return static_cast<typename M::value_type>(static_cast<double>(rest) +
                                               rounded_product(distance, std::exp2(-elapsed / half_life)));
  }
};

}  // namespace orbis::octree

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Decay: change of a voxel's value with the time since its last observation. Objects seen long ago may have moved
/// away, so the evidence for their voxels fades.
///
/// A policy is a pure function of a voxel's value, so that a map can apply it once per distinct value
/// (`occupancy_octree::transform`). Write a custom policy for another kind of decay, or to make voxels unknown again:
/// it returns an empty result for these.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>

#include <orbis/core/rounded.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::octree {

/// Value to which `v` decays: log-odds 0, or the value nearest to 0 with the same state.
template <sensor_model M>
[[nodiscard]] inline typename M::value_type resting_value(typename M::value_type v) noexcept {
  using T = typename M::value_type;
  if (is_occupied<M>(v)) return std::max(T{0}, M::occupancy_threshold);
  return M::occupancy_threshold > 0 ? T{0} : largest_free_value<M>();
}

/// Exponential decay: the difference between the log-odds and resting_value halves every `half_life`. Two applications
/// are equivalent to one with the sum of the elapsed times, up to rounding. Free voxels never become occupied, or vice
/// versa.
/// @pre half_life > 0, elapsed >= 0
template <sensor_model M = log_odds<>>
struct exponential_decay {
  double half_life = 60.0;  ///< seconds
  double elapsed = 1.0;     ///< time since the last application, seconds

  [[nodiscard]] typename M::value_type operator()(typename M::value_type v) const noexcept {
    assert(half_life > 0.0 && elapsed >= 0.0);
    const auto rest = resting_value<M>(v);
    const double distance = static_cast<double>(v) - static_cast<double>(rest);
    return static_cast<typename M::value_type>(static_cast<double>(rest) +
                                               rounded_product(distance, std::exp2(-elapsed / half_life)));
  }
};

}  // namespace orbis::octree

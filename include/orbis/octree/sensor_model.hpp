// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Sensor models: what one observation does to the belief about a voxel.
///
/// A. Hornung, K. M. Wurm, M. Bennewitz, C. Stachniss, W. Burgard, "OctoMap: An efficient
/// probabilistic 3D mapping framework based on octrees", Autonomous Robots 34, 2013: the belief is
/// kept as log-odds `L(n) = log(P(n) / (1 - P(n)))`; an observation adds to it (equation 2), and the
/// sum is clamped (equation 4) so that the map stays able to change and compresses well.
#pragma once

#include <cmath>
#include <concepts>

namespace orbis::octree {

/// What is known about a place.
enum class occupancy { unknown, free, occupied };

/// The log-odds of a probability in (0, 1).
[[nodiscard]] inline float log_odds_of(double probability) noexcept {
  return static_cast<float>(std::log(probability / (1.0 - probability)));
}
/// The probability of log-odds.
[[nodiscard]] inline double probability_of(double log_odds) noexcept { return 1.0 - 1.0 / (1.0 + std::exp(log_odds)); }

/// A sensor model: additive hit and miss, bounds, and the value from which on a voxel counts as
/// occupied. All are compile-time constants.
template <class M>
concept sensor_model = std::floating_point<typename M::value_type> && requires {
  requires M::miss < 0 && 0 < M::hit;
  requires M::clamp_min < M::clamp_max;
  requires M::clamp_min < M::occupancy_threshold&& M::occupancy_threshold <= M::clamp_max;
};

/// The model OctoMap uses unless told otherwise: P(hit) = 0.7, P(miss) = 0.4, beliefs kept within
/// [0.1192, 0.971], occupied from 0.5 on. Derive from it, or write your own, to change constants:
///
/// @code
///   struct confident : orbis::octree::log_odds<> { static constexpr float hit = 1.5F; };
///   orbis::octree::occupancy_octree<confident> map{0.05};
/// @endcode
template <std::floating_point T = float>
struct log_odds {
  using value_type = T;
  static constexpr T hit{0.847297847F};
  static constexpr T miss{-0.405465096F};
  static constexpr T clamp_min{-2.00002789F};
  static constexpr T clamp_max{3.51103067F};
  static constexpr T occupancy_threshold{0};
};

/// The value after one more observation that the voxel is occupied. A value at or beyond its bound
/// stays.
template <sensor_model M>
[[nodiscard]] constexpr typename M::value_type after_hit(typename M::value_type v) noexcept {
  if (v >= M::clamp_max) return v;
  v += M::hit;
  return v < M::clamp_min ? M::clamp_min : v > M::clamp_max ? M::clamp_max : v;
}
/// The value after one more observation that the voxel is free.
template <sensor_model M>
[[nodiscard]] constexpr typename M::value_type after_miss(typename M::value_type v) noexcept {
  if (v <= M::clamp_min) return v;
  v += M::miss;
  return v < M::clamp_min ? M::clamp_min : v > M::clamp_max ? M::clamp_max : v;
}
template <sensor_model M>
[[nodiscard]] constexpr bool is_occupied(typename M::value_type v) noexcept {
  return v >= M::occupancy_threshold;
}

}  // namespace orbis::octree

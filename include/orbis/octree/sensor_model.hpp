// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Sensor models: effect of one observation on the belief about a voxel.
///
/// A. Hornung, K. M. Wurm, M. Bennewitz, C. Stachniss, W. Burgard, "OctoMap: An efficient probabilistic 3D mapping
/// framework based on octrees", Autonomous Robots 34, 2013: the belief is stored as log-odds `L(n) = log(P(n) / (1 -
/// P(n)))`; an observation adds to it (equation 2), and the sum is clamped (equation 4), so that the map can still
/// change and compresses well.
#pragma once

#include <bit>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace orbis::octree::detail {

/// Natural logarithm of `x`, within three units in the last place of a double, so that after rounding to float it
/// equals that of std::log (except for about one value in ten million).
///
/// `x = m * 2^e` with `m` in [0.7, 1.41]; `log(m) = 2 atanh(s)` for `s = (m - 1) / (m + 1)`, by the series `s + s^3 / 3
/// + s^5 / 5 + ...`, |s| < 0.172. For constants; std::log is faster at run time.
/// @pre x is positive and normal
[[nodiscard]] constexpr double constexpr_log(double x) noexcept {
  const auto bits = std::bit_cast<std::uint64_t>(x);
  assert(bits >> 52U >= 1 && bits >> 52U < 0x7ff);
  auto exponent = static_cast<int>(bits >> 52U) - 1023;
  double m = std::bit_cast<double>((bits & 0x000fffffffffffffULL) | 0x3ff0000000000000ULL);
  if (m > 1.4142135623730951) {
    m *= 0.5;
    ++exponent;
  }
  const double s = (m - 1.0) / (m + 1.0);
  double series = 0.0;
  for (int k = 27; k != 1; k -= 2) series = (series + 1.0 / k) * (s * s);
  // log 2 in two parts; the product of the first one with an exponent is exact
  constexpr double log2_high = 0x1.62e42fee00000p-1, log2_low = 0x1.a39ef35793c76p-33;
  return exponent * log2_high + (2.0 * s + (2.0 * s * series + exponent * log2_low));
}

}  // namespace orbis::octree::detail

namespace orbis::octree {

/// State of a voxel.
enum class occupancy { unknown, free, occupied };

/// Log-odds of a probability in (0, 1).
[[nodiscard]] constexpr float to_log_odds(double probability) noexcept {
  const double odds = probability / (1.0 - probability);
  return static_cast<float>(std::is_constant_evaluated() ? detail::constexpr_log(odds) : std::log(odds));
}
/// Probability for the given log-odds.
[[nodiscard]] inline double to_probability(double log_odds) noexcept { return 1.0 - 1.0 / (1.0 + std::exp(log_odds)); }
[[deprecated("use to_log_odds")]] [[nodiscard]] constexpr float log_odds_of(double probability) noexcept {
  return to_log_odds(probability);
}
[[deprecated("use to_probability")]] [[nodiscard]] inline double probability_of(double log_odds) noexcept {
  return to_probability(log_odds);
}

// -- requirements of a sensor model, as separate concepts for specific compiler messages

/// The model defines all five constants, of type `value_type`, which is a floating-point type.
template <class M>
concept has_constants_of_its_value_type = std::floating_point<typename M::value_type> && requires {
  { M::hit } -> std::same_as<const typename M::value_type&>;
  { M::miss } -> std::same_as<const typename M::value_type&>;
  { M::clamp_min } -> std::same_as<const typename M::value_type&>;
  { M::clamp_max } -> std::same_as<const typename M::value_type&>;
  { M::occupancy_threshold } -> std::same_as<const typename M::value_type&>;
};
template <class M>
concept hit_raises_and_miss_lowers = M::miss < 0 && 0 < M::hit;
template <class M>
concept clamps_are_ordered = M::clamp_min < M::clamp_max;
/// A voxel at the lower bound is free; one at the upper bound is occupied.
template <class M>
concept threshold_is_between_clamps = M::clamp_min < M::occupancy_threshold&& M::occupancy_threshold <= M::clamp_max;
/// A sensor model: additive hit and miss, bounds, and the minimum value of an occupied voxel. All are compile-time
/// constants.
template <class M>
concept sensor_model = has_constants_of_its_value_type<M> && hit_raises_and_miss_lowers<M> && clamps_are_ordered<M> &&
    threshold_is_between_clamps<M>;

/// A sensor model whose maps can be stored in OctoMap's files.
template <class M>
concept octomap_model = sensor_model<M> && std::same_as<typename M::value_type, float>;

/// OctoMap's default model: P(hit) = 0.7, P(miss) = 0.4, beliefs clamped to [0.1192, 0.971], occupied at 0.5 and above.
/// Derive from it, or write a custom model, to change constants:
///
/// @code
///   struct confident : orbis::octree::log_odds<> { static constexpr float hit = 1.5F; };
///   orbis::octree::occupancy_octree<confident> map{0.05};
/// @endcode
///
/// To specify probabilities instead, see sensor_model_from.
template <std::floating_point T = float>
struct log_odds {
  using value_type = T;
  static constexpr T hit{0.847297847F};
  static constexpr T miss{-0.405465096F};
  static constexpr T clamp_min{-2.00002789F};
  static constexpr T clamp_max{3.51103067F};
  static constexpr T occupancy_threshold{0};
};

/// Value after one more observation of the voxel as occupied. A value at or beyond its bound does not change.
template <sensor_model M>
[[nodiscard]] constexpr typename M::value_type after_hit(typename M::value_type v) noexcept {
  if (v >= M::clamp_max) return v;
  v = static_cast<typename M::value_type>(v + M::hit);
  return v < M::clamp_min ? M::clamp_min : v > M::clamp_max ? M::clamp_max : v;
}
/// Value after one more observation of the voxel as free.
template <sensor_model M>
[[nodiscard]] constexpr typename M::value_type after_miss(typename M::value_type v) noexcept {
  if (v <= M::clamp_min) return v;
  v = static_cast<typename M::value_type>(v + M::miss);
  return v < M::clamp_min ? M::clamp_min : v > M::clamp_max ? M::clamp_max : v;
}
template <sensor_model M>
[[nodiscard]] constexpr bool is_occupied(typename M::value_type v) noexcept {
  return v >= M::occupancy_threshold;
}

/// The largest value that counts as free.
template <sensor_model M>
[[nodiscard]] inline typename M::value_type largest_free_value() noexcept {
  return std::nextafter(M::occupancy_threshold, -std::numeric_limits<typename M::value_type>::infinity());
}

// -- models from probabilities

/// The probabilities that correspond to OctoMap's constants.
struct octomap_probabilities {
  static constexpr double hit = 0.7;   ///< probability that a voxel is occupied if a ray ends in it
  static constexpr double miss = 0.4;  ///< probability that a voxel is occupied if a ray crosses it
  static constexpr double clamp_min = 0.1192;
  static constexpr double clamp_max = 0.971;
  static constexpr double occupancy_threshold = 0.5;
};

/// A type whose members are the five probabilities of a sensor model, each in (0, 1).
template <class P>
concept sensor_probabilities = requires {
  requires 0 < P::hit&& P::hit < 1;
  requires 0 < P::miss&& P::miss < 1;
  requires 0 < P::clamp_min&& P::clamp_min < 1;
  requires 0 < P::clamp_max&& P::clamp_max < 1;
  requires 0 < P::occupancy_threshold&& P::occupancy_threshold < 1;
};

namespace detail {

template <std::floating_point T>
[[nodiscard]] constexpr T constant_log_odds(double probability) noexcept {
  return static_cast<T>(constexpr_log(probability / (1.0 - probability)));
}

}  // namespace detail

/// Sensor model computed at compile time from five probabilities.
///
/// @code
///   struct doubtful : orbis::octree::octomap_probabilities { static constexpr double hit = 0.6; };
///   orbis::octree::occupancy_octree<orbis::octree::sensor_model_from<doubtful>> map{0.05};
/// @endcode
template <sensor_probabilities P, std::floating_point T = float>
struct sensor_model_from {
  using value_type = T;
  static constexpr T hit = detail::constant_log_odds<T>(P::hit);
  static constexpr T miss = detail::constant_log_odds<T>(P::miss);
  static constexpr T clamp_min = detail::constant_log_odds<T>(P::clamp_min);
  static constexpr T clamp_max = detail::constant_log_odds<T>(P::clamp_max);
  static constexpr T occupancy_threshold = detail::constant_log_odds<T>(P::occupancy_threshold);
};

}  // namespace orbis::octree

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Sensor models: what one observation does to the belief about a voxel.
///
/// A. Hornung, K. M. Wurm, M. Bennewitz, C. Stachniss, W. Burgard, "OctoMap: An efficient
/// probabilistic 3D mapping framework based on octrees", Autonomous Robots 34, 2013: the belief is
/// kept as log-odds `L(n) = log(P(n) / (1 - P(n)))`; an observation adds to it (equation 2), and the
/// sum is clamped (equation 4) so that the map stays able to change and compresses well.
///
/// A model counts in its own units: log-odds themselves in floating point, or whole multiples of a
/// small step, which take a half or a quarter of the memory.
#pragma once

#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <orbis/octree/detail/storage/constexpr_log.hpp>

namespace orbis::octree {

/// What is known about a place.
enum class occupancy { unknown, free, occupied };

/// The log-odds of a probability in (0, 1).
[[nodiscard]] constexpr float log_odds_of(double probability) noexcept {
  const double odds = probability / (1.0 - probability);
  return static_cast<float>(std::is_constant_evaluated() ? detail::constexpr_log(odds) : std::log(odds));
}
/// The probability of log-odds.
[[nodiscard]] inline double probability_of(double log_odds) noexcept { return 1.0 - 1.0 / (1.0 + std::exp(log_odds)); }

// -- what makes a sensor model; apart, so that a compiler's message names what is wrong

/// Beliefs are floating-point numbers or signed integers.
template <class T>
concept belief_value = std::floating_point<T> || std::signed_integral<T>;
/// All five constants are there and have the value type.
template <class M>
concept has_constants_of_its_value_type = belief_value<typename M::value_type> && requires {
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
/// At the lower bound a voxel is free, at the upper one it is occupied.
template <class M>
concept threshold_is_between_clamps = M::clamp_min < M::occupancy_threshold&& M::occupancy_threshold <= M::clamp_max;
/// One observation more at either bound stays within the value type, so that sums need no wider one.
template <class M>
concept sums_fit_value_type = std::floating_point<typename M::value_type> ||
    (M::clamp_max <= std::numeric_limits<typename M::value_type>::max() - M::hit &&
     M::clamp_min >= std::numeric_limits<typename M::value_type>::min() - M::miss);
/// `scale`: units for each 1.0 of log-odds. An integer model says its scale; without one it is 1.
template <class M>
concept scale_is_positive = (std::floating_point<typename M::value_type> && !requires { M::scale; }) || M::scale > 0;

/// A sensor model: additive hit and miss, bounds, and the value from which on a voxel counts as
/// occupied. All are compile-time constants in the model's units.
template <class M>
concept sensor_model = has_constants_of_its_value_type<M> && hit_raises_and_miss_lowers<M> && clamps_are_ordered<M> &&
    threshold_is_between_clamps<M> && sums_fit_value_type<M> && scale_is_positive<M>;

/// A sensor model whose maps OctoMap's files can hold.
template <class M>
concept octomap_model = sensor_model<M> && std::same_as<typename M::value_type, float>;

/// The model OctoMap uses unless told otherwise: P(hit) = 0.7, P(miss) = 0.4, beliefs kept within
/// [0.1192, 0.971], occupied from 0.5 on. Derive from it, or write your own, to change constants:
///
/// @code
///   struct confident : orbis::octree::log_odds<> { static constexpr float hit = 1.5F; };
///   orbis::octree::occupancy_octree<confident> map{0.05};
/// @endcode
///
/// Or say probabilities, see sensor_model_from.
template <belief_value T = float>
struct log_odds;

template <std::floating_point T>
struct log_odds<T> {
  using value_type = T;
  static constexpr T hit{0.847297847F};
  static constexpr T miss{-0.405465096F};
  static constexpr T clamp_min{-2.00002789F};
  static constexpr T clamp_max{3.51103067F};
  static constexpr T occupancy_threshold{0};
};

/// The model above with values in thousandths of log-odds: hit and miss are right to 0.12 %, the bounds to 0.001 %.
template <>
struct log_odds<std::int16_t> {
  using value_type = std::int16_t;
  static constexpr double scale = 1000.0;
  static constexpr value_type hit = 847;
  static constexpr value_type miss = -405;
  static constexpr value_type clamp_min = -2000;
  static constexpr value_type clamp_max = 3511;
  static constexpr value_type occupancy_threshold = 0;
};

/// The model above with values in steps of 0.037 of log-odds. A miss is almost exactly eleven steps and a hit
/// twenty-three: both are right to 0.06 %, the bounds to 0.5 % (probabilities 0.1202 and 0.9707).
template <>
struct log_odds<std::int8_t> {
  using value_type = std::int8_t;
  static constexpr double scale = 27.13;
  static constexpr value_type hit = 23;
  static constexpr value_type miss = -11;
  static constexpr value_type clamp_min = -54;
  static constexpr value_type clamp_max = 95;
  static constexpr value_type occupancy_threshold = 0;
};

/// The value after one more observation that the voxel is occupied. A value at or beyond its bound
/// stays.
template <sensor_model M>
[[nodiscard]] constexpr typename M::value_type after_hit(typename M::value_type v) noexcept {
  if (v >= M::clamp_max) return v;
  v = static_cast<typename M::value_type>(v + M::hit);
  return v < M::clamp_min ? M::clamp_min : v > M::clamp_max ? M::clamp_max : v;
}
/// The value after one more observation that the voxel is free.
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

// -- a model's units and the log-odds and probabilities they stand for

/// Units for each 1.0 of log-odds.
template <sensor_model M>
inline constexpr double units_per_log_odds = [] {
  if constexpr (requires { M::scale; })
    return static_cast<double>(M::scale);
  else
    return 1.0;
}();

/// The log-odds that a value stands for.
template <sensor_model M>
[[nodiscard]] constexpr double to_log_odds(typename M::value_type v) noexcept {
  return static_cast<double>(v) / units_per_log_odds<M>;
}
/// The probability that a value stands for.
template <sensor_model M>
[[nodiscard]] double probability_of(typename M::value_type v) noexcept {
  return probability_of(to_log_odds<M>(v));
}

/// The largest value that counts as free.
template <sensor_model M>
[[nodiscard]] inline typename M::value_type largest_free_value() noexcept {
  using T = typename M::value_type;
  if constexpr (std::floating_point<T>)
    return std::nextafter(M::occupancy_threshold, -std::numeric_limits<T>::infinity());
  else
    return static_cast<T>(M::occupancy_threshold - 1);
}

/// The value for log-odds: the nearest within the bounds, but never on the other side of the
/// threshold, so that what was free stays free. @pre not NaN
template <sensor_model M>
[[nodiscard]] typename M::value_type from_log_odds(double log_odds) noexcept {
  using T = typename M::value_type;
  const double units = log_odds * units_per_log_odds<M>;
  if (units <= static_cast<double>(M::clamp_min)) return M::clamp_min;
  if (units >= static_cast<double>(M::clamp_max)) return M::clamp_max;
  const auto nearest = static_cast<T>(std::floating_point<T> ? units : std::round(units));
  const bool free = units < static_cast<double>(M::occupancy_threshold);
  return free && is_occupied<M>(nearest) ? largest_free_value<M>() : nearest;
}
/// The value of one model as a value of another, see from_log_odds.
template <sensor_model From, sensor_model To>
[[nodiscard]] typename To::value_type convert_value(typename From::value_type v) noexcept {
  return from_log_odds<To>(to_log_odds<From>(v));
}

// -- models from probabilities

/// The probabilities behind OctoMap's constants.
struct octomap_probabilities {
  static constexpr double hit = 0.7;   ///< that a voxel is occupied if a ray ends in it
  static constexpr double miss = 0.4;  ///< that a voxel is occupied if a ray crosses it
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

/// The scale that sensor_model_from takes unless the probabilities bring their own (`scale`).
template <belief_value T>
inline constexpr double default_scale = std::floating_point<T> ? 1.0
                                        : sizeof(T) == 1       ? log_odds<std::int8_t>::scale
                                                               : log_odds<std::int16_t>::scale;

namespace detail {

/// Rounded to the nearest; a bound of `T` if beyond, which no sensor model can have.
template <belief_value T>
[[nodiscard]] constexpr T units_of_probability(double probability, double scale) noexcept {
  const double units = constexpr_log(probability / (1.0 - probability)) * scale;
  if constexpr (std::floating_point<T>) return static_cast<T>(units);
  if (units <= static_cast<double>(std::numeric_limits<T>::lowest())) return std::numeric_limits<T>::lowest();
  if (units >= static_cast<double>(std::numeric_limits<T>::max())) return std::numeric_limits<T>::max();
  return static_cast<T>(units < 0 ? units - 0.5 : units + 0.5);
}

}  // namespace detail

/// The sensor model of five probabilities, worked out by the compiler; integers are rounded to the
/// nearest.
///
/// @code
///   struct doubtful : orbis::octree::octomap_probabilities { static constexpr double hit = 0.6; };
///   orbis::octree::occupancy_octree<orbis::octree::sensor_model_from<doubtful, std::int16_t>> map{0.05};
/// @endcode
template <sensor_probabilities P, belief_value T = float>
struct sensor_model_from {
  using value_type = T;
  static constexpr double scale = [] {
    if constexpr (requires { P::scale; })
      return static_cast<double>(P::scale);
    else
      return default_scale<T>;
  }();
  static constexpr T hit = detail::units_of_probability<T>(P::hit, scale);
  static constexpr T miss = detail::units_of_probability<T>(P::miss, scale);
  static constexpr T clamp_min = detail::units_of_probability<T>(P::clamp_min, scale);
  static constexpr T clamp_max = detail::units_of_probability<T>(P::clamp_max, scale);
  static constexpr T occupancy_threshold = detail::units_of_probability<T>(P::occupancy_threshold, scale);
};

}  // namespace orbis::octree

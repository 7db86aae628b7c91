// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Decay: how the value of a voxel changes with the time since it was observed. What was seen long ago may have moved
/// away; its voxels fade towards unknown and become unknown in the end.
///
/// A policy is a pure function of a voxel's value, so that a map may apply it once for each distinct
/// value. None of those here ever turns free into occupied or back.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <concepts>
#include <optional>
#include <type_traits>

#include <orbis/core/rounded.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::octree {

/// What makes of a value of `Model` its value some time later, or nothing (std::optional) where it is
/// forgotten. Any function object will do.
template <class Policy, class Model>
concept decay_policy = sensor_model<Model> && requires(const Policy& policy, typename Model::value_type v) {
  { policy(v) } -> std::convertible_to<std::optional<typename Model::value_type>>;
};
/// A decay policy that names its sensor model, so that others can build on it.
template <class Policy>
concept model_decay_policy = decay_policy<Policy, typename Policy::model>;

/// The value after decay; empty: unknown from now on.
template <sensor_model M, decay_policy<M> Policy>
[[nodiscard]] std::optional<typename M::value_type> decayed(const Policy& policy, typename M::value_type v) {
  return policy(v);
}

/// Where a value comes to rest: log-odds 0, or the value nearest to it that has the same state.
template <sensor_model M>
[[nodiscard]] inline typename M::value_type resting_value(typename M::value_type v) noexcept {
  using T = typename M::value_type;
  if (is_occupied<M>(v)) return std::max(T{0}, M::occupancy_threshold);
  return M::occupancy_threshold > 0 ? T{0} : largest_free_value<M>();
}

/// Log-odds halve in every `half_life`. Applying it twice is applying it once for the sum of the times,
/// but for rounding.
/// @pre half_life > 0, elapsed >= 0
template <sensor_model M = log_odds<>>
struct exponential_decay {
  using model = M;
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

/// Log-odds fall, or rise, by `rate` in every second until they are at rest.
/// @pre rate >= 0, elapsed >= 0
template <sensor_model M = log_odds<>>
struct linear_decay {
  using model = M;
  double rate = 0.01;    ///< log-odds per second
  double elapsed = 1.0;  ///< since the last time, seconds

  [[nodiscard]] typename M::value_type operator()(typename M::value_type v) const noexcept {
    assert(rate >= 0.0 && elapsed >= 0.0);
    const auto rest = resting_value<M>(v);
    const double distance = static_cast<double>(v) - static_cast<double>(rest);
    const double left = std::max(std::abs(distance) - rate * elapsed, 0.0);
    return static_cast<typename M::value_type>(static_cast<double>(rest) + std::copysign(left, distance));
  }
};

/// Only occupied voxels decay: the ghosts of what has moved away fade, free space stays.
template <model_decay_policy Policy>
struct occupied_only {
  using model = typename Policy::model;
  Policy policy;

  [[nodiscard]] auto operator()(typename model::value_type v) const {
    using result = std::remove_cvref_t<std::invoke_result_t<const Policy&, typename model::value_type>>;
    return is_occupied<model>(v) ? result{policy(v)} : result{v};
  }
};
template <class Policy>
occupied_only(Policy) -> occupied_only<Policy>;

/// After `policy`, a voxel whose log-odds are within `margin` of rest becomes unknown.
///
/// @code
///   forget_below{occupied_only{exponential_decay<>{.half_life = 20.0, .elapsed = 0.5}}, 0.1}
/// @endcode
template <model_decay_policy Policy>
struct forget_below {
  using model = typename Policy::model;
  Policy policy;
  double margin = 0.1;  ///< log-odds, >= 0

  [[nodiscard]] std::optional<typename model::value_type> operator()(typename model::value_type v) const {
    const std::optional<typename model::value_type> later = policy(v);
    if (!later) return std::nullopt;
    const double distance = static_cast<double>(*later) - static_cast<double>(resting_value<model>(*later));
    return std::abs(distance) <= margin ? std::nullopt : later;
  }
};
template <class Policy>
forget_below(Policy) -> forget_below<Policy>;
template <class Policy>
forget_below(Policy, double) -> forget_below<Policy>;

}  // namespace orbis::octree

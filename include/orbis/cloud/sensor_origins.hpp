// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Positions of the sensors that measured the points of a cloud.
#pragma once

#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <optional>
#include <ranges>
#include <span>
#include <type_traits>
#include <vector>

#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/types.hpp>

namespace orbis::cloud {

/// Additional properties of a cloud type: a customisation point whose primary template is empty. A specialisation may
/// define `static std::optional<vec3> sensor_origin(const C&)`, the position from which all its points were measured,
/// metres, in the frame of the points.
template <class C>
struct cloud_traits {};

/// A cloud type that can report its sensor origin.
template <class C>
concept cloud_with_sensor_origin = requires(const std::remove_cvref_t<C>& cloud) {
  { cloud_traits<std::remove_cvref_t<C>>::sensor_origin(cloud) } -> std::same_as<std::optional<vec3>>;
};

/// Sensor origin of a cloud, in the frame of its points. The most specific source is used: `ranges`, else `common`,
/// else the origin that the cloud itself specifies (`cloud_traits`).
struct sensor_origins {
  std::optional<vec3> common{};     ///< origin of all points, metres
  std::span<const float> ranges{};  ///< distance of each point from its sensor, metres; empty or as long as the cloud
};

/// Returns the origin that a cloud itself specifies.
template <class C>
[[nodiscard]] std::optional<vec3> stated_sensor_origin([[maybe_unused]] const C& cloud) {
  if constexpr (cloud_with_sensor_origin<C>) {
    return cloud_traits<C>::sensor_origin(cloud);
  } else {
    return std::nullopt;
  }
}

/// Computes for each point its distance in metres from its sensor. The result is NaN if the distance is unknown, if the
/// point, origin or given range is not finite, or if the given range is negative. O(n); the same result for every
/// policy.
/// @pre `ranges` of `origins` is empty or as long as `points`
template <execution_policy Policy, point_range Points>
[[nodiscard]] std::vector<float> sensor_ranges(const Policy& policy, const Points& points,
                                               const sensor_origins& origins = {}) {
  constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
  const std::size_t count = std::ranges::size(points);
  assert(origins.ranges.empty() || origins.ranges.size() == count);
  std::vector<float> out(count, unknown);
  const std::optional<vec3> common = origins.common.has_value() ? origins.common : stated_sensor_origin(points);
  if (origins.ranges.empty() && !common.has_value()) return out;
  for_each_index(policy, count, 4096, [&](std::size_t i) {
    const auto p = coordinates<double>(detail::point_at(points, i));
    const vec3 position{p[0], p[1], p[2]};
    if (!all_finite(position)) return;
    const float range = origins.ranges.empty() ? static_cast<float>(norm(position - *common)) : origins.ranges[i];
    if (std::isfinite(range) && range >= 0) out[i] = range;
  });
  return out;
}

}  // namespace orbis::cloud

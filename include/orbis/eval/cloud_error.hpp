// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Distances between the points of a map and the true surface.
#pragma once

#include <cmath>
#include <concepts>
#include <cstddef>
#include <ranges>
#include <utility>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>
#include <orbis/eval/statistics.hpp>

namespace orbis::eval {

/// A callable that returns the distance (metres; the sign is ignored) from a point to the surface. It is called
/// concurrently from several threads.
template <class F>
concept distance_function = requires(const F& distance, const vec3& point) {
  { distance(point) } -> std::convertible_to<double>;
};

struct cloud_error_options {
  double tolerance = 0.02;  ///< maximum distance counted in `percent_within`, metres
};

struct cloud_error {
  error_statistics distance;    ///< metres
  double percent_within = 0.0;  ///< percentage of points at most `tolerance` from the surface
  std::size_t skipped = 0;      ///< points with non-finite coordinates or distances
};

/// Statistics of the distances from `points` to the surface that `distance` describes; the same for every policy.
/// Errors: no_data (no finite point). O(n log n) in addition to the calls to `distance`.
template <execution_policy Policy, point_range Points, distance_function Distance>
[[nodiscard]] result<cloud_error> cloud_to_surface(const Policy& policy, const Points& points, const Distance& distance,
                                                   const cloud_error_options& options = {}) {
  const auto n = static_cast<std::size_t>(std::ranges::size(points));
  std::vector<double> distances(n);
  const auto begin = std::ranges::begin(points);
  for_each_index(policy, n, 4096, [&](std::size_t i) {
    const auto xyz = coordinates<double>(begin[static_cast<std::ranges::range_difference_t<const Points>>(i)]);
    const vec3 p(xyz[0], xyz[1], xyz[2]);
    distances[i] = all_finite(p) ? std::abs(static_cast<double>(distance(p))) : HUGE_VAL;
  });
  std::erase_if(distances, [](double d) { return !std::isfinite(d); });
  if (distances.empty()) return fail(errc::no_data, "cloud error", "there is no finite point");
  std::size_t within = 0;
  for (const double d : distances) within += d <= options.tolerance ? 1 : 0;
  const std::size_t measured = distances.size();
  return cloud_error{summarize(std::move(distances)),
                     100.0 * static_cast<double>(within) / static_cast<double>(measured), n - measured};
}

}  // namespace orbis::eval

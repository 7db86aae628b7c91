// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Automatic selection of filters: analyses the cloud and returns the choice with its evidence.
///
/// 1. *Views*, if available (select_by_views.hpp), take precedence: points that their rays pass through are removed, as
///    are points measured only by a stray pixel or by a view that contradicts all others.
/// 2. *Density*: the logarithm of a point's mean distance to a few neighbours, minus a reference. The reference is one
///    value for all points, a line over the logarithm of the range (a depth camera's points thin out with range), or,
///    for clouds of uneven density, the value of the surroundings. Outliers appear as a second population of points
///    that lie on no surface; the threshold is placed in the valley before it. Without such a population, only points
///    far outside the bulk are removed, so that a clean cloud does not change.
/// 3. *Connectivity*: isolated groups of a few points and small clusters far from the surface are removed.
///
/// A step is part of the chosen chain only if it removes points.
#pragma once

#include <cassert>
#include <cstdint>
#include <ranges>
#include <span>
#include <vector>

#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/cloud/filter_chain.hpp>
#include <orbis/cloud/filter_choice.hpp>
#include <orbis/cloud/sensor_origins.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud {

/// Indices of the inliers, ascending, and the filters that selected them.
struct automatic_result {
  std::vector<std::uint32_t> inliers;
  filter_choice choice;
};

namespace detail {

/// Type-erased callback that evaluates points against views. Returns false if cancelled.
struct view_judge {
  const void* context = nullptr;
  /// Sets `left` to 0 for the points that the views exclude, and adds a step and its evidence; null if there are no
  /// views.
  bool (*run)(const void* context, std::span<char> left, filter_choice& choice) = nullptr;
};

/// `filter_automatically` on a type-erased cloud and views. `ranges`: one per point, or empty if none is known.
template <execution_policy Policy>
[[nodiscard]] automatic_result choose_and_filter(const Policy& policy, const point_view& points,
                                                 std::span<const float> ranges, const select_options& options,
                                                 const view_judge& views);
/// The given ranges, or those computed from the sensor's origin; empty if neither is known.
struct known_ranges {
  std::vector<float> own{};
  std::span<const float> all{};

  template <execution_policy Policy, point_range Points>
  known_ranges(const Policy& policy, const Points& points, const select_options& options) : all{options.ranges} {
    assert(all.empty() || all.size() == std::ranges::size(points));
    if (!all.empty() || (!options.sensor_origin && !stated_sensor_origin(points))) return;
    own = sensor_ranges(policy, points, {.common = options.sensor_origin});
    all = own;
  }
  known_ranges(const known_ranges&) = delete;
  known_ranges& operator=(const known_ranges&) = delete;
};

}  // namespace detail

/// Selects filters from the points, without views. A cloud that is empty or too small to analyse gets an empty chain.
/// O(n log n).
/// @pre neighbors > 0; ranges is empty or as long as points
template <execution_policy Policy, point_range Points>
[[nodiscard]] automatic_result filter_automatically(const Policy& policy, const Points& points,
                                                    const select_options& options = {}) {
  assert(options.neighbors > 0);
  const auto& threads = detail::as_parallel(policy);
  return detail::choose_and_filter(threads, detail::viewed_points{points},
                                   detail::known_ranges{threads, points, options}.all, options, {});
}

/// Selects filters as `filter_automatically` does, but does not compute the inliers.
template <execution_policy Policy, point_range Points>
[[nodiscard]] filter_choice select_filter(const Policy& policy, const Points& points,
                                          const select_options& options = {}) {
  return filter_automatically(policy, points, options).choice;
}

}  // namespace orbis::cloud

#ifndef ORBIS_COMPILED
#include <orbis/cloud/select-inl.hpp>
#endif

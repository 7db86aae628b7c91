// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A filter that chooses itself: the cloud is judged, and the choice comes with its evidence.
///
/// 1. *Views*, where there are any, know best: what their rays pass through is not there, and what only
///    a stray pixel or a view that contradicts all others has measured is not either.
/// 2. *Density*: a point's measure is how much sparser its surroundings are than usual, the logarithm of
///    its mean distance to a few neighbours less a reference: one for all points, or a line over the
///    logarithm of the range (a depth camera's points thin out with range); and the surroundings', where the
///    cloud itself is of uneven density. Outliers show as a second population of points that lie on no
///    surface; the threshold goes into the valley before it. Where there is none, only points far
///    outside the bulk go: a clean cloud stays as it is.
/// 3. *Connection*: groups of a few points with nothing around, and small clusters far from the surface.
///
/// Every step is part of the chosen chain only if it removes something.
///
/// The library orbis::compiled holds what judges points alone; who gives views includes select-inl.hpp.
#pragma once

#include <cassert>
#include <cstdint>
#include <ranges>
#include <span>
#include <string>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/cloud/filter_chain.hpp>
#include <orbis/cloud/filter_choice.hpp>
#include <orbis/cloud/ray_evidence_counter.hpp>
#include <orbis/cloud/sensor_origins.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud {

/// The inliers' indices, ascending, and the choice that led to them.
struct automatic_result {
  std::vector<std::uint32_t> inliers;
  filter_choice choice;
};

namespace detail {

/// What a choice asks about views. False: cancelled.
struct view_judge {
  const void* context = nullptr;
  /// Clears what is left where the views exclude a point, and adds a step and its reason; null without views.
  bool (*run)(const void* context, std::span<char> left, filter_choice& choice,
              std::vector<std::string>& reasons) = nullptr;
};

/// `filter_automatically` for any points and views. `ranges`: of each point, or empty where none is known.
template <execution_policy Policy>
[[nodiscard]] automatic_result choose_and_filter(const Policy& policy, const point_view& points,
                                                 std::span<const float> ranges, const select_options& options,
                                                 const view_judge& views);
/// The ranges that are given, or those from the sensor's origin; empty where neither is known.
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

/// Judges the cloud by its points and by the depth images that it was made of, or that saw the same
/// place, and returns the points that the chosen filters keep. The images testify against points in
/// front of what they measured, which no density can show: moving objects, wrong poses.
///
/// Deterministic, the same for every policy. `on_progress` counts the views; if it cancels, the
/// chain is empty, the reason "cancelled", and all points stay. O(n log n + views (pixels + n)).
/// @pre neighbors > 0; ranges is empty or as long as points; views' images have the camera's size; samples, if there
/// are any, are of these views
template <execution_policy Policy, point_range Points, posed_depth_range Views, camera::camera_model Camera>
[[nodiscard]] automatic_result filter_automatically(const Policy& policy, const Points& points, const Views& views,
                                                    const Camera& camera, const select_options& options = {},
                                                    progress on_progress = {});

/// Judges the cloud by its points alone. An empty cloud, or one too small to judge, gets an empty chain. O(n log n).
/// @pre neighbors > 0; ranges is empty or as long as points
template <execution_policy Policy, point_range Points>
[[nodiscard]] automatic_result filter_automatically(const Policy& policy, const Points& points,
                                                    const select_options& options = {}) {
  assert(options.neighbors > 0);
  const auto& threads = detail::threads_of(policy);
  return detail::choose_and_filter(threads, detail::viewed_points{points},
                                   detail::known_ranges{threads, points, options}.all, options, {});
}

/// Judges the cloud and says which filters suit it: `filter_automatically` without its inliers.
template <execution_policy Policy, point_range Points>
[[nodiscard]] filter_choice select_filter(const Policy& policy, const Points& points,
                                          const select_options& options = {}) {
  return filter_automatically(policy, points, options).choice;
}

}  // namespace orbis::cloud

#ifndef ORBIS_COMPILED
#include <orbis/cloud/select-inl.hpp>
#endif

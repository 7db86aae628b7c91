// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The outlier filter of a map, as a choice at run time, with a report of what it did.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <optional>
#include <ranges>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/cloud/filter_chain.hpp>
#include <orbis/cloud/radius.hpp>
#include <orbis/cloud/ray_evidence.hpp>
#include <orbis/cloud/select.hpp>
#include <orbis/cloud/statistical.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/progress.hpp>

namespace orbis::mapping {

enum class filter_kind {
  automatic,  ///< chosen by the cloud: `cloud::filter_automatically`
  none,
  statistical,
  radius
};

struct filter_options {
  filter_kind kind = filter_kind::automatic;
  cloud::select_options automatic{};  ///< its `ranges` are set from the map
  cloud::statistical_options statistical{};
  cloud::radius_options radius{};
};

/// What a filter did, and why.
struct filter_report {
  cloud::filter_chain mode{};  ///< its steps; `to_string` gives their names, such as "log-statistical+cluster"
  std::string reason{};
  std::size_t points = 0;  ///< before
  std::size_t removed = 0;
  double seconds = 0;
  std::optional<cloud::filter_choice> choice{};  ///< where the cloud chose
};

struct filtered_indices {
  std::vector<std::uint32_t> inliers;  ///< ascending
  filter_report report;
};

namespace detail {

/// `automatically(select_options)` is the automatic filter.
template <execution_policy Policy, point_range Points, class Automatic>
[[nodiscard]] filtered_indices filter_by_kind(const Policy& policy, const Points& points, std::span<const float> ranges,
                                              const filter_options& options, Automatic&& automatically) {
  const auto start = std::chrono::steady_clock::now();
  filtered_indices out;
  filter_report& report = out.report;
  report.points = std::ranges::size(points);
  switch (options.kind) {
    case filter_kind::automatic: {
      cloud::select_options select = options.automatic;
      select.ranges = ranges;
      cloud::automatic_result result = automatically(select);
      out.inliers = std::move(result.inliers);
      report.mode = result.choice.chain;
      report.reason = result.choice.reason;
      report.choice = std::move(result.choice);
      break;
    }
    case filter_kind::none:
      out.inliers.resize(report.points);
      std::iota(out.inliers.begin(), out.inliers.end(), 0U);
      report.reason = "asked for";
      break;
    case filter_kind::statistical: {
      cloud::statistical_result result = cloud::statistical_filter(policy, points, options.statistical);
      out.inliers = std::move(result.inliers);
      report.mode = {options.statistical};
      report.reason = "asked for; mean distance to " + std::to_string(options.statistical.neighbors) +
                      " neighbors at most " + cloud::detail::in_words(1e3 * result.threshold) + " mm";
      break;
    }
    case filter_kind::radius:
      out.inliers = cloud::radius_inliers(policy, points, options.radius);
      report.mode = {options.radius};
      report.reason = "asked for; at least " + std::to_string(options.radius.min_neighbors) + " neighbors within " +
                      cloud::detail::in_words(1e3 * options.radius.radius) + " mm";
      break;
  }
  report.removed = report.points - out.inliers.size();
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return out;
}

}  // namespace detail

/// Runs the filter. `ranges`: for each point the distance from which it was seen, metres, or empty.
/// O(n log n).
template <execution_policy Policy, point_range Points>
[[nodiscard]] filtered_indices filter_points(const Policy& policy, const Points& points, std::span<const float> ranges,
                                             const filter_options& options = {}) {
  return detail::filter_by_kind(policy, points, ranges, options, [&](const cloud::select_options& select) {
    return cloud::filter_automatically(policy, points, select);
  });
}

/// The same, and the automatic filter listens to the views that the points come from, too.
/// `on_progress` counts the views, twice; if it cancels, all points stay. @pre the images have the camera's size
template <execution_policy Policy, point_range Points, cloud::posed_depth_range Views, camera::camera_model Camera>
[[nodiscard]] filtered_indices filter_points(const Policy& policy, const Points& points, std::span<const float> ranges,
                                             const Views& views, const Camera& camera,
                                             const filter_options& options = {}, progress on_progress = {}) {
  return detail::filter_by_kind(policy, points, ranges, options, [&](const cloud::select_options& select) {
    return cloud::filter_automatically(policy, points, views, camera, select, on_progress);
  });
}

}  // namespace orbis::mapping

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The outlier filter of a map, as a choice at run time, with a report of what it did.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <orbis/cloud/radius.hpp>
#include <orbis/cloud/select.hpp>
#include <orbis/cloud/statistical.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

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
  cloud::filter_mode mode = cloud::filter_mode::none;
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

/// Runs the filter. `ranges`: for each point the distance from which it was seen, metres, or empty.
/// O(n log n).
template <execution_policy Policy, point_range Points>
[[nodiscard]] filtered_indices filter_points(const Policy& policy, const Points& points, std::span<const float> ranges,
                                             const filter_options& options = {}) {
  const auto start = std::chrono::steady_clock::now();
  filtered_indices out;
  filter_report& report = out.report;
  report.points = std::ranges::size(points);
  switch (options.kind) {
    case filter_kind::automatic: {
      cloud::select_options select = options.automatic;
      select.ranges = ranges;
      cloud::automatic_result result = cloud::filter_automatically(policy, points, select);
      out.inliers = std::move(result.inliers);
      report.mode = result.choice.mode;
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
      report.mode = cloud::filter_mode::statistical;
      report.reason = "asked for; mean distance to " + std::to_string(options.statistical.neighbors) +
                      " neighbors at most " + cloud::detail::in_words(1e3 * result.threshold) + " mm";
      break;
    }
    case filter_kind::radius:
      out.inliers = cloud::radius_inliers(policy, points, options.radius);
      report.mode = cloud::filter_mode::radius;
      report.reason = "asked for; at least " + std::to_string(options.radius.min_neighbors) + " neighbors within " +
                      cloud::detail::in_words(1e3 * options.radius.radius) + " mm";
      break;
  }
  report.removed = report.points - out.inliers.size();
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return out;
}

}  // namespace orbis::mapping

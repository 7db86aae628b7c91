// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The outlier filter of a map, selected at run time, with a report: numbers and enumerators, no text.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <optional>
#include <ranges>
#include <span>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/cloud/cluster.hpp>
#include <orbis/cloud/filter_chain.hpp>
#include <orbis/cloud/log_statistical.hpp>
#include <orbis/cloud/radius.hpp>
#include <orbis/cloud/ray_evidence-inl.hpp>
#include <orbis/cloud/select.hpp>
#include <orbis/cloud/select_by_views-inl.hpp>
#include <orbis/cloud/statistical.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

namespace orbis::mapping {

enum class filter_kind {
  automatic,  ///< selected for the cloud by `cloud::filter_automatically`
  none,
  statistical,
  radius,
  log_statistical,
  cluster,
  ray_evidence  ///< uses the keyframes' depth images; without depth images every point is kept
};

struct filter_options {
  filter_kind kind = filter_kind::automatic;
  cloud::select_options automatic{};  ///< `ranges` and `samples` are set from the map
  cloud::statistical_options statistical{};
  cloud::radius_options radius{};
  cloud::log_statistical_options log_statistical{};
  cloud::cluster_options cluster{};
  cloud::ray_evidence_options ray_evidence{};
};

/// Components of the neighbour graph that the cluster filter found.
struct cluster_count {
  std::size_t components = 0;
  std::size_t removed = 0;   ///< components that are small and far from the large ones
  std::size_t min_size = 0;  ///< components with fewer points count as small
};

/// Report of a filter run: the steps, and the measurements on which they are based.
struct filter_report {
  filter_kind kind = filter_kind::none;  ///< the kind that was requested
  /// The steps; `to_string` returns their names, such as "log-statistical+cluster". Empty if all points are kept: the
  /// automatic filter found no outliers, `kind` is `none`, or `ray_evidence` without depth images was requested.
  cloud::filter_chain mode{};
  std::size_t points = 0;  ///< number of points before filtering
  std::size_t removed = 0;
  double seconds = 0;
  /// Maximum mean distance of an inlier to its neighbours, metres; set by `statistical` and `log_statistical`.
  std::optional<double> max_mean_distance{};
  std::optional<cluster_count> clusters{};       ///< set by `cluster`
  std::optional<cloud::filter_choice> choice{};  ///< set by `automatic`: the choice with its evidence
};

struct filtered_indices {
  std::vector<std::uint32_t> inliers;  ///< ascending
  filter_report report;
};

namespace detail {

[[nodiscard]] inline std::vector<std::uint32_t> all_indices(std::size_t count) {
  std::vector<std::uint32_t> all(count);
  std::iota(all.begin(), all.end(), 0U);
  return all;
}

/// Runs the filter of the given kind. `automatically(select_options)` runs the automatic filter;
/// `by_rays(ray_evidence_options)` returns the inliers of the ray-evidence filter.
template <execution_policy Policy, point_range Points, class Automatic, class ByRays>
[[nodiscard]] filtered_indices filter_by_kind(const Policy& policy, const Points& points, std::span<const float> ranges,
                                              const filter_options& options, Automatic&& automatically,
                                              ByRays&& by_rays) {
  const auto start = std::chrono::steady_clock::now();
  filtered_indices out;
  filter_report& report = out.report;
  report.kind = options.kind;
  report.points = std::ranges::size(points);
  switch (options.kind) {
    case filter_kind::automatic: {
      cloud::select_options select = options.automatic;
      select.ranges = ranges;
      cloud::automatic_result result = automatically(select);
      out.inliers = std::move(result.inliers);
      report.mode = result.choice.chain;
      report.choice = std::move(result.choice);
      break;
    }
    case filter_kind::none: out.inliers = all_indices(report.points); break;
    case filter_kind::statistical: {
      cloud::statistical_result result = cloud::statistical_filter(policy, points, options.statistical);
      out.inliers = std::move(result.inliers);
      report.mode = {options.statistical};
      report.max_mean_distance = result.threshold;
      break;
    }
    case filter_kind::radius:
      out.inliers = cloud::radius_inliers(policy, points, options.radius);
      report.mode = {options.radius};
      break;
    case filter_kind::log_statistical: {
      cloud::log_statistical_result result = cloud::log_statistical_filter(policy, points, options.log_statistical);
      out.inliers = std::move(result.inliers);
      report.mode = {cloud::density_step{.mode = cloud::filter_mode::log_statistical,
                                         .neighbors = options.log_statistical.neighbors,
                                         .usual = {result.median, 0},
                                         .threshold = result.threshold}};
      report.max_mean_distance = result.threshold_distance;
      break;
    }
    case filter_kind::cluster: {
      cloud::cluster_result result = cloud::cluster_filter(policy, points, options.cluster);
      out.inliers = std::move(result.inliers);
      report.mode = {options.cluster};
      report.clusters = {
          .components = result.sizes.size(),
          .removed = static_cast<std::size_t>(std::count(result.removed.begin(), result.removed.end(), char{1})),
          .min_size = result.min_size};
      break;
    }
    case filter_kind::ray_evidence:
      out.inliers = by_rays(options.ray_evidence);
      report.mode = {cloud::ray_step{.evidence = options.ray_evidence}};
      break;
  }
  report.removed = report.points - out.inliers.size();
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return out;
}

}  // namespace detail

/// Runs the filter. `ranges`: the distance from which each point was observed, metres; may be empty. O(n log n).
template <execution_policy Policy, point_range Points>
[[nodiscard]] filtered_indices filter_points(const Policy& policy, const Points& points, std::span<const float> ranges,
                                             const filter_options& options = {}) {
  filtered_indices out = detail::filter_by_kind(
      policy, points, ranges, options,
      [&](const cloud::select_options& select) { return cloud::filter_automatically(policy, points, select); },
      [&](const cloud::ray_evidence_options&) { return detail::all_indices(std::ranges::size(points)); });
  if (options.kind == filter_kind::ray_evidence) out.report.mode.clear();
  return out;
}

/// Number of passes of `filter_points` over the views.
[[nodiscard]] constexpr std::size_t view_passes(const filter_options& options) noexcept {
  if (options.kind == filter_kind::ray_evidence) return options.ray_evidence.resolve_ghosts ? 2 : 1;
  return options.kind == filter_kind::automatic ? 1 : 0;
}

/// As above; the automatic filter also uses the views that the points come from. `on_progress` counts the views in each
/// pass (`view_passes`); if it cancels, all points are kept. @pre the images have the camera's size
template <execution_policy Policy, point_range Points, cloud::posed_depth_range Views, camera::camera_model Camera>
[[nodiscard]] filtered_indices filter_points(const Policy& policy, const Points& points, std::span<const float> ranges,
                                             const Views& views, const Camera& camera,
                                             const filter_options& options = {}, progress on_progress = {}) {
  return detail::filter_by_kind(
      policy, points, ranges, options,
      [&](const cloud::select_options& select) {
        return cloud::filter_automatically(policy, points, views, camera, select, on_progress);
      },
      [&](const cloud::ray_evidence_options& rays) {
        bool cancelled = false;
        const auto watched = [&](std::size_t done, std::size_t total) {
          cancelled = cancelled || !on_progress(done, total);
          return !cancelled;
        };
        auto inliers = cloud::ray_evidence_inliers(policy, points, views, camera, rays, watched);
        return cancelled ? detail::all_indices(std::ranges::size(points)) : std::move(inliers);
      });
}

}  // namespace orbis::mapping

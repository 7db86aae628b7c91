// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A filter that chooses itself: the cloud is judged, and the choice comes with its evidence.
///
/// The measure of a point is how much sparser its surroundings are than usual: the logarithm of its
/// mean distance to a few neighbours, less a reference that is either the same for all points or a
/// line over the logarithm of the range at which the sensor saw them (a depth camera's points thin
/// out, and its noise grows, with range). Outliers show as a second population, apart from the bulk:
/// the threshold goes where the histogram has a valley before a later peak. Where there is none, only
/// points far outside the bulk go: a clean cloud stays as it is.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <orbis/cloud/log_density.hpp>
#include <orbis/cloud/mean_knn_distance.hpp>
#include <orbis/cloud/statistical.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/types.hpp>

namespace orbis::cloud {

/// The kinds of filter.
enum class filter_mode {
  none,                  ///< everything (finite) stays
  statistical,           ///< mu + alpha sigma of the mean neighbour distance
  radius,                ///< a number of neighbours within a radius
  log_statistical,       ///< log mean neighbour distance against its median over the cloud
  range_log_statistical  ///< log mean neighbour distance against a line over log range
};

[[nodiscard]] constexpr std::string_view to_string(filter_mode mode) noexcept {
  switch (mode) {
    case filter_mode::none: return "none";
    case filter_mode::statistical: return "statistical";
    case filter_mode::radius: return "radius";
    case filter_mode::log_statistical: return "log-statistical";
    case filter_mode::range_log_statistical: return "range-log-statistical";
  }
  return "unknown";
}

struct select_options {
  std::size_t neighbors = 8;            ///< over which a point's spacing is averaged; > 0
  std::optional<vec3> sensor_origin{};  ///< where all points were seen from, metres
  /// Per point, metres from the sensor that saw it; wins over sensor_origin. A point whose range is not
  /// finite stays.
  std::span<const float> ranges{};
  cloud::non_finite non_finite = cloud::non_finite::drop;
};

/// The numbers behind a choice. Lengths in metres; "log" means natural logarithms.
struct filter_evidence {
  std::size_t points = 0;             ///< all
  std::size_t judged = 0;             ///< finite, as is their range, and not identical to all their neighbours
  double median_spacing = 0;          ///< median over the points of the mean neighbour distance
  double left_scale = 0;              ///< width of the bulk below its median, log
  double right_scale = 0;             ///< and above
  double global_scale = 0;            ///< width with the global reference, log
  std::optional<double> range_scale;  ///< width with the reference over range, where ranges are known
  double valley_position = 0;         ///< above the bulk's median, log
  double valley_ratio = 0;            ///< later peak over valley; 1.6 and more counts as two populations
  double shoulder = 0;                ///< fraction of points between the bulk and the valley's threshold
  double beyond = 0;                  ///< fraction of points beyond the threshold chosen
};

/// What was chosen, with which parameters, and why.
struct filter_choice {
  filter_mode mode = filter_mode::none;
  std::size_t neighbors = 8;  ///< over which the spacing is averaged
  log_line reference;         ///< usual log spacing at a log range; slope 0 for `log_statistical`
  double threshold = 0;       ///< outliers: log spacing - reference > threshold
  filter_evidence evidence;
  std::string reason;  ///< one or two sentences
};

/// The inliers' indices, ascending, and the choice that led to them.
struct automatic_result {
  std::vector<std::uint32_t> inliers;
  filter_choice choice;
};

namespace detail {

[[nodiscard]] inline std::string in_words(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

/// The points that can be judged, and what they are judged on.
struct judged_points {
  std::vector<std::uint32_t> index;
  std::vector<double> log_spacing;
  std::vector<double> log_range;  ///< empty where ranges are not known
};

template <point_range Points>
[[nodiscard]] judged_points points_to_judge(const Points& points, std::span<const float> spacing,
                                            const select_options& options) {
  judged_points out;
  const auto first = std::ranges::begin(points);
  const bool ranged = !options.ranges.empty() || options.sensor_origin.has_value();
  for (std::size_t i = 0; i != spacing.size(); ++i) {
    // Identical points are not outliers, and have no logarithm.
    if (!(spacing[i] > 0) || !std::isfinite(spacing[i])) continue;
    if (ranged) {
      double range = 0;
      if (!options.ranges.empty()) {
        range = options.ranges[i];
      } else {
        const auto p = coordinates<double>(first[static_cast<std::ranges::range_difference_t<const Points>>(i)]);
        range = (vec3{p[0], p[1], p[2]} - *options.sensor_origin).norm();
      }
      if (!std::isfinite(range)) continue;  // nothing to judge it by
      out.log_range.push_back(std::log(std::max(range, 1e-3)));
    }
    out.index.push_back(static_cast<std::uint32_t>(i));
    out.log_spacing.push_back(std::log(double{spacing[i]}));
  }
  return out;
}

/// Log spacing less the reference.
[[nodiscard]] inline std::vector<double> residuals(const judged_points& judged, const log_line& reference) {
  std::vector<double> out = judged.log_spacing;
  for (std::size_t i = 0; i != out.size(); ++i) {
    out[i] -= reference.slope != 0 ? reference.at(judged.log_range[i]) : reference.intercept;
  }
  return out;
}

/// Width of the bulk as it counts in the comparison of references.
[[nodiscard]] inline double width(const bulk& b) noexcept { return std::max(b.left_scale, 0.5 * b.right_scale); }

[[nodiscard]] inline filter_choice judge(const judged_points& judged, std::size_t points,
                                         const select_options& options) {
  constexpr std::size_t enough = 50;
  filter_choice choice;
  choice.neighbors = options.neighbors;
  filter_evidence& evidence = choice.evidence;
  evidence.points = points;
  evidence.judged = judged.index.size();
  if (judged.index.size() < enough) {
    choice.reason = "too few points (" + std::to_string(judged.index.size()) + ") to judge";
    return choice;
  }

  // The reference: the narrower bulk wins, the simpler one with a head start.
  std::vector<double> sorted = judged.log_spacing;
  choice.reference = {quantile(sorted, 0.5), 0};
  evidence.median_spacing = std::exp(choice.reference.intercept);
  std::vector<double> u = residuals(judged, choice.reference);
  bulk center = bulk_of(u);
  evidence.global_scale = width(center);
  bool by_range = false;
  if (!judged.log_range.empty()) {
    if (const auto line = fit_log_line(judged.log_spacing, judged.log_range)) {
      std::vector<double> ranged = residuals(judged, *line);
      const bulk ranged_center = bulk_of(ranged);
      evidence.range_scale = width(ranged_center);
      if (line->slope > 0 && *evidence.range_scale < 0.85 * evidence.global_scale) {
        by_range = true;
        choice.reference = *line;
        u = std::move(ranged);
        center = ranged_center;
      }
    }
  }
  evidence.left_scale = center.left_scale;
  evidence.right_scale = center.right_scale;
  const auto fraction_between = [&](double low, double high) {
    const auto n = std::count_if(u.begin(), u.end(),
                                 [&](double x) { return x - center.median > low && x - center.median <= high; });
    return static_cast<double>(n) / static_cast<double>(u.size());
  };

  // The threshold: in the valley between two populations, else far outside the only one.
  const valley v = deepest_valley(u, center.median, std::max(0.55, std::min(2.5 * center.left_scale, 1.4)));
  evidence.valley_position = v.position;
  evidence.valley_ratio = v.ratio;
  const bool two_populations = v.ratio > 1.6;
  double threshold = two_populations ? v.position : std::max(1.6, 6 * center.left_scale);

  // Flying pixels make a shoulder on the bulk rather than a population apart.
  const double shoulder_start = std::max(0.75, 5 * center.left_scale);
  evidence.shoulder = shoulder_start < threshold ? fraction_between(shoulder_start, threshold) : 0;
  const bool shoulder = evidence.shoulder > (v.ratio > 3 ? 0.025 : 0.01);
  if (shoulder) threshold = shoulder_start;
  evidence.beyond = fraction_between(threshold, std::numeric_limits<double>::infinity());
  choice.threshold = threshold + center.median;

  const std::string percent = in_words(100 * evidence.beyond) + " %";
  const std::string times = in_words(std::exp(threshold)) + " times";
  if (evidence.beyond == 0) {
    choice.reason = "one population, and no point lies " + times + " sparser than usual";
  } else {
    choice.mode = by_range ? filter_mode::range_log_statistical : filter_mode::log_statistical;
    if (shoulder) {
      choice.reason = "a shoulder of " + in_words(100 * evidence.shoulder) + " % of the points just outside the bulk";
    } else if (two_populations) {
      choice.reason = "two populations, the valley between them " + in_words(v.ratio) + " times lower than the peak";
    } else {
      choice.reason = "one population";
    }
    choice.reason += "; " + percent + " of the points lie more than " + times + " sparser than usual";
  }
  choice.reason += by_range ? " at their range" : "";
  choice.reason += " (median spacing " + in_words(1e3 * evidence.median_spacing) + " mm)";
  return choice;
}

}  // namespace detail

/// Judges the cloud and says which filter suits it. Deterministic; O(n log n). An empty cloud, or one
/// too small to judge, gets `filter_mode::none`.
/// @pre neighbors > 0; ranges is empty or as long as points
template <execution_policy Policy, point_range Points>
[[nodiscard]] filter_choice select_filter(const Policy& policy, const Points& points,
                                          const select_options& options = {}) {
  assert(options.ranges.empty() || options.ranges.size() == std::ranges::size(points));
  const std::vector<float> spacing = all_mean_knn_distance(policy, points, options.neighbors);
  return detail::judge(detail::points_to_judge(points, spacing, options), spacing.size(), options);
}

/// `select_filter`, and the points that the chosen filter keeps.
/// @pre neighbors > 0; ranges is empty or as long as points
template <execution_policy Policy, point_range Points>
[[nodiscard]] automatic_result filter_automatically(const Policy& policy, const Points& points,
                                                    const select_options& options = {}) {
  assert(options.ranges.empty() || options.ranges.size() == std::ranges::size(points));
  const std::vector<float> spacing = all_mean_knn_distance(policy, points, options.neighbors);
  const detail::judged_points judged = detail::points_to_judge(points, spacing, options);
  automatic_result out;
  out.choice = detail::judge(judged, spacing.size(), options);

  std::vector<char> outlier(spacing.size(), 0);
  const auto first = std::ranges::begin(points);
  if (options.non_finite == cloud::non_finite::drop) {
    for (std::size_t i = 0; i != outlier.size(); ++i) {
      outlier[i] = !is_finite(coordinates<float>(first[static_cast<std::ranges::range_difference_t<const Points>>(i)]));
    }
  }
  if (out.choice.mode != filter_mode::none) {
    const std::vector<double> u = detail::residuals(judged, out.choice.reference);
    for (std::size_t i = 0; i != u.size(); ++i) outlier[judged.index[i]] = u[i] > out.choice.threshold;
  }
  for (std::size_t i = 0; i != outlier.size(); ++i) {
    if (outlier[i] == 0) out.inliers.push_back(static_cast<std::uint32_t>(i));
  }
  return out;
}

}  // namespace orbis::cloud

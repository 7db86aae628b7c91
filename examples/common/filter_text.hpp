// SPDX-License-Identifier: BSD-3-Clause
//
// Explains the result of a filter in words: the library returns only numbers and enumerators.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <variant>

#include <orbis/cloud/filter_choice.hpp>
#include <orbis/mapping/filter.hpp>

#include "count_text.hpp"

namespace examples {

/// Formats a number >= 0 with three significant digits, or as a whole number with separators: "0.123", "12,345".
[[nodiscard]] inline std::string number_text(double value) {
  if (value >= 999.5 && value < 1e15) return count_text(static_cast<std::uintmax_t>(std::llround(value)));
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}
[[nodiscard]] inline std::string percent_text(double share) { return number_text(100 * share) + " %"; }
[[nodiscard]] inline std::string millimetres_text(double metres) { return number_text(1e3 * metres) + " mm"; }
[[nodiscard]] inline std::string depth_images_text(std::size_t count) {
  return count_text(count) + (count == 1 ? " depth image" : " depth images");
}

/// Points that contradict the depth images.
[[nodiscard]] inline std::string step_text(const orbis::cloud::ray_step& step, const orbis::cloud::filter_evidence& e) {
  const std::size_t ignored = step.distrusted.size();
  std::string text;
  if (ignored > 0) {
    text = count_text(ignored) + " of " + depth_images_text(e.views) + (ignored == 1 ? " contradicts" : " contradict") +
           " the others (by up to " + percent_text(e.worst_conflict) + ") and " + (ignored == 1 ? "is" : "are") +
           " ignored; ";
  }
  if (e.passed_through > 0)
    text += "the rays of " + (ignored > 0 ? "the other " : std::string{}) + depth_images_text(e.views - ignored) +
            " pass through " + percent_text(e.passed_through) + " of the points";
  if (e.unsupported > 0)
    text += (e.passed_through > 0 ? ", and at another " : "at ") + percent_text(e.unsupported) +
            (e.passed_through > 0 ? "" : " of the points") + " no depth image shows a surface (stray pixels " +
            (ignored > 0 ? "and ignored images " : "") + "do not count)";
  return text;
}

/// Points that are sparser than a threshold, and the finding that determines the threshold.
[[nodiscard]] inline std::string test_text(const orbis::cloud::density_evidence& e) {
  using orbis::cloud::filter_mode;
  using orbis::cloud::threshold_source;
  std::string text = percent_text(e.removed) + " of the points are more than " + number_text(std::exp(e.threshold)) +
                     " times sparser than usual";
  if (e.mode == filter_mode::range_log_statistical) text += " for their range";
  if (e.mode == filter_mode::local_log_statistical) text += " for their surroundings";
  text += " and not on a surface";
  if (e.source == threshold_source::valley)
    text += " (a separate population: its peak is " + number_text(e.valley_ratio) +
            " times higher than the valley before it)";
  if (e.source == threshold_source::shoulder)
    text += " (" + percent_text(e.shoulder) + " form a shoulder of the distribution, as flying pixels do)";
  return text;
}

/// The reason for an automatic choice: a part for each step, separated by semicolons.
[[nodiscard]] inline std::string filter_text(const orbis::cloud::filter_choice& choice) {
  using namespace orbis::cloud;
  const filter_evidence& e = choice.evidence;
  if (choice.status == choice_status::cancelled) return "cancelled";
  std::string text;
  const auto add = [&](const std::string& part) { text += (text.empty() ? "" : "; ") + part; };
  auto test = e.density.begin();
  for (const filter_step& step : choice.chain) {
    if (const auto* rays = std::get_if<ray_step>(&step)) {
      add(step_text(*rays, e));
    } else if (std::holds_alternative<density_step>(step)) {
      test = std::find_if(test, e.density.end(), [](const density_evidence& d) { return d.removed > 0; });
      if (test != e.density.end()) add(test_text(*test++));
    } else if (const auto* isolation = std::get_if<isolation_step>(&step)) {
      add(percent_text(e.isolated) + " are groups of fewer than " + count_text(isolation->min_size) +
          " points more than " + number_text(isolation->reach) + " usual spacings from all others");
    } else if (const auto* clusters = std::get_if<cluster_options>(&step)) {
      add(percent_text(e.clustered) + " are clusters of fewer than " + count_text(clusters->min_size) +
          " points at least " + number_text(clusters->min_gap) + " spacings from the surface");
    }
  }
  if (choice.status == choice_status::too_few_points)
    return text.empty() ? "too few points (" + count_text(e.judged) + ") to evaluate" : text;
  if (text.empty()) text = "no outliers found";
  return text + " (median spacing " + millimetres_text(e.median_spacing) +
         (e.range_exponent > 0 ? ", which grows with range)" : ")");
}

/// The reason for the removals of a map's filter.
[[nodiscard]] inline std::string filter_text(const orbis::mapping::filter_report& report) {
  using orbis::mapping::filter_kind;
  const auto by_distance = [&](std::size_t neighbors) {
    return "requested; mean distance to " + count_text(neighbors) + " neighbours at most " +
           millimetres_text(report.max_mean_distance.value());
  };
  switch (report.kind) {
    case filter_kind::automatic: return filter_text(report.choice.value());
    case filter_kind::none: return "requested";
    case filter_kind::statistical:
      return by_distance(std::get<orbis::cloud::statistical_options>(report.mode.front()).neighbors);
    case filter_kind::radius: {
      const auto& options = std::get<orbis::cloud::radius_options>(report.mode.front());
      return "requested; at least " + count_text(options.min_neighbors) + " neighbours within " +
             millimetres_text(options.radius);
    }
    case filter_kind::log_statistical:
      return by_distance(std::get<orbis::cloud::density_step>(report.mode.front()).neighbors);
    case filter_kind::cluster:
      return "requested; " + count_text(report.clusters->removed) + " of " + count_text(report.clusters->components) +
             " components have fewer than " + count_text(report.clusters->min_size) +
             " points and are far from the others";
    case filter_kind::ray_evidence:
      return report.mode.empty() ? "ray evidence was requested, but there are no depth images: every point is kept"
                                 : "requested; removes points that rays of other keyframes pass through";
  }
  return {};
}

/// Precedes the reason if moved objects were removed from depth images beforehand; otherwise empty.
[[nodiscard]] inline std::string moved_objects_text(std::size_t pixels, std::size_t keyframes) {
  if (pixels == 0) return {};
  return count_text(pixels) + (pixels == 1 ? " pixel of " : " pixels of ") + count_text(keyframes) +
         (keyframes == 1 ? " keyframe " : " keyframes ") + (pixels == 1 ? "shows" : "show") +
         " moved objects (rays of other keyframes pass through them) and " + (pixels == 1 ? "was" : "were") +
         " removed; ";
}

}  // namespace examples

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of statistical.hpp.
#pragma once

#include <algorithm>
#include <utility>

#include <orbis/cloud/all_knn-inl.hpp>
#include <orbis/cloud/detail/select/decision.hpp>
#include <orbis/cloud/statistical.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/core/rounded.hpp>

namespace orbis::cloud {

ORBIS_LAZY_INLINE statistical_result statistical_decision(std::vector<float> mean_distance,
                                                          const statistical_options& options) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  double sum = 0;
  double sum_of_squares = 0;
  std::size_t n = 0;
  for (const float d : mean_distance) {
    if (std::isnan(d)) continue;
    sum += d;
    sum_of_squares += d * d;  // a float product, as in PCL
    ++n;
  }
  statistical_result out;
  const auto count = static_cast<double>(n);
  if (n > 0) out.mean = sum / count;
  const double variance = n > 1 ? (sum_of_squares - sum * sum / count) / (count - 1) : 0.0;
  out.standard_deviation = std::isnan(variance) ? infinity : std::sqrt(std::max(variance, 0.0));
  out.threshold =
      variance >= 0 ? out.mean + rounded_product(options.sigma_multiplier, out.standard_deviation) : infinity;
  if (std::isnan(out.threshold)) out.threshold = infinity;
  out.inliers = detail::indices_where(mean_distance.size(), [&](std::size_t i) {
    if (std::isnan(mean_distance[i])) return options.non_finite == non_finite::keep;
    return !(mean_distance[i] > out.threshold);
  });
  out.mean_distance = std::move(mean_distance);
  return out;
}

ORBIS_LAZY_INLINE range_statistical_result range_statistical_decision(std::span<const float> mean_distance,
                                                                      std::span<const float> ranges,
                                                                      const range_statistical_options& options) {
  assert(ranges.size() == mean_distance.size());
  assert(options.angle >= 0 && options.noise >= 0 && options.angle + options.noise > 0 && options.least_range > 0);
  range_statistical_result out;
  out.normalised.assign(mean_distance.size(), std::numeric_limits<float>::quiet_NaN());
  double sum = 0;
  for (std::size_t i = 0; i != mean_distance.size(); ++i) {
    if (!std::isfinite(ranges[i]) || ranges[i] < 0) continue;
    const auto u = static_cast<float>(mean_distance[i] / explained_spacing(ranges[i], options));
    out.normalised[i] = u;
    if (!std::isfinite(u)) continue;
    sum += u;
    ++out.judged;
  }
  if (out.judged > 0) {
    const auto count = static_cast<double>(out.judged);
    out.mean = sum / count;
    double squares = 0;  // sum of squared deviations from the mean, to avoid cancellation
    for (const float u : out.normalised) {
      if (std::isfinite(u)) squares += (u - out.mean) * (u - out.mean);
    }
    if (out.judged > 1) out.standard_deviation = std::sqrt(squares / (count - 1));
    constexpr double rounding = 1 + 0x1p-20;  // allows for rounding of the scores, so that equal scores are all inliers
    out.threshold = out.mean * rounding + options.sigma_multiplier * out.standard_deviation;
  }
  out.inliers = detail::indices_where(mean_distance.size(), [&](std::size_t i) {
    if (std::isnan(mean_distance[i])) return options.non_finite == non_finite::keep;
    return !(double{out.normalised[i]} > out.threshold);
  });
  return out;
}

namespace detail {

template <execution_policy Policy>
statistical_result filter_statistically(const Policy& policy, const point_view& points,
                                        const statistical_options& options) {
  statistical_result out = statistical_decision(find_mean_distances(policy, points, options.neighbors), options);
  out.inliers =
      inliers_by_score(points, out.mean_distance, options.non_finite, [&](float d) { return d > out.threshold; });
  return out;
}

template <execution_policy Policy>
range_statistical_result filter_by_range(const Policy& policy, const point_view& points, std::span<const float> ranges,
                                         const range_statistical_options& options) {
  const std::vector<float> spacing = find_mean_distances(policy, points, options.neighbors);
  range_statistical_result out = range_statistical_decision(spacing, ranges, options);
  out.inliers =
      inliers_by_score(points, out.normalised, options.non_finite, [&](float u) { return double{u} > out.threshold; });
  return out;
}

}  // namespace detail

}  // namespace orbis::cloud

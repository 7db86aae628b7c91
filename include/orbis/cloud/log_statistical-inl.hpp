// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of log_statistical.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include <orbis/cloud/all_knn-inl.hpp>
#include <orbis/cloud/detail/select/decision.hpp>
#include <orbis/cloud/log_statistical.hpp>
#include <orbis/core/inline.hpp>

namespace orbis::cloud {

ORBIS_LAZY_INLINE log_statistical_result log_statistical_decision(std::vector<float> mean_distance,
                                                                  const log_statistical_options& options) {
  log_statistical_result out;
  std::vector<float> values;
  values.reserve(mean_distance.size());
  for (const float d : mean_distance) {
    if (d > 0 && std::isfinite(d)) values.push_back(d);
  }
  out.judged = values.size();
  out.threshold = options.threshold;
  if (!values.empty()) {
    // The logarithm preserves order, so it is computed for the median only.
    float* const middle = values.data() + (values.size() - 1) / 2;
    std::nth_element(values.data(), middle, values.data() + values.size());
    out.median = std::log(double{*middle});
    out.threshold_distance = std::exp(out.median + out.threshold);
  }
  out.inliers = detail::indices_where(mean_distance.size(), [&](std::size_t i) {
    const float d = mean_distance[i];
    return std::isnan(d) ? options.non_finite == non_finite::keep : !(double{d} > out.threshold_distance);
  });
  out.mean_distance = std::move(mean_distance);
  return out;
}

namespace detail {

template <execution_policy Policy>
log_statistical_result filter_by_logarithm(const Policy& policy, const point_view& points,
                                           const log_statistical_options& options) {
  log_statistical_result out =
      log_statistical_decision(find_mean_distances(policy, points, options.neighbors), options);
  out.inliers = inliers_by_score(points, out.mean_distance, options.non_finite,
                                 [&](float d) { return double{d} > out.threshold_distance; });
  return out;
}

}  // namespace detail

}  // namespace orbis::cloud

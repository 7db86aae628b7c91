// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Statistical outlier removal: points whose mean distance to their neighbours is unusually large.
///
/// Source: R. B. Rusu, Z. C. Marton, N. Blodow, M. Dolha, M. Beetz, "Towards 3D point cloud based
/// object maps for household environments", Robotics and Autonomous Systems 56, 2008.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <orbis/cloud/decision.hpp>
#include <orbis/cloud/mean_knn_distance.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/progress.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/rounded.hpp>

namespace orbis::cloud {

struct statistical_options {
  std::size_t neighbors = 50;     ///< k, the point itself not counted; > 0
  double sigma_multiplier = 1.0;  ///< alpha
  cloud::non_finite non_finite = cloud::non_finite::drop;
};

/// The filter's decision, and what it is based on.
struct statistical_result {
  std::vector<std::uint32_t> inliers;  ///< indices, ascending
  std::vector<float> mean_distance;    ///< per point, metres; NaN where not finite or alone
  double mean = 0;                     ///< mu of the mean distances, metres
  double standard_deviation = 0;       ///< sigma, with n - 1
  double threshold = 0;                ///< mu + alpha sigma; points beyond it are outliers
};

/// Decides on mean distances that are known already: see `statistical_inliers`. Points that have none
/// (NaN) are kept or dropped as `non_finite` says. O(n).
///
/// The variance is a difference of sums, as others compute it, and where all distances are nearly equal
/// it can come out below zero. Such a cloud has no spread that could be measured: sigma is reported as 0
/// and the threshold as infinite, everything stays (as in PCL, where both are NaN and no distance is
/// larger). The same goes, with an infinite sigma, where distances or their squares overflow.
[[nodiscard]] inline statistical_result statistical_decision(std::vector<float> mean_distance,
                                                             const statistical_options& options = {}) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  double sum = 0;
  double sum_of_squares = 0;
  std::size_t n = 0;
  for (const float d : mean_distance) {
    if (std::isnan(d)) continue;
    sum += d;
    sum_of_squares += d * d;  // a float product: part of the definition that others share
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

namespace detail {

template <point_range Points>
[[nodiscard]] statistical_result decide_statistically(const Points& points, std::vector<float> mean_distance,
                                                      const statistical_options& options) {
  statistical_result out = statistical_decision(std::move(mean_distance), options);
  out.inliers =
      inliers_by_score(points, out.mean_distance, options.non_finite, [&](float d) { return d > out.threshold; });
  return out;
}

}  // namespace detail

/// The same as `statistical_inliers`, with the scores and the threshold.
template <execution_policy Policy, point_range Points>
[[nodiscard]] statistical_result statistical_filter(const Policy& policy, const Points& points,
                                                    const statistical_options& options = {}) {
  assert(options.neighbors > 0);
  return detail::decide_statistically(points, all_mean_knn_distance(policy, points, options.neighbors), options);
}

/// The same with reports of progress, in leaves of sixteen points; an error (`cancelled`) if the callback asks
/// to stop. For other filters give the callback to `all_mean_knn_distance` or `all_knn`, which take all the
/// time, and decide on their results.
template <execution_policy Policy, point_range Points>
[[nodiscard]] result<statistical_result> statistical_filter(const Policy& policy, const Points& points,
                                                            const statistical_options& options, progress on_progress) {
  assert(options.neighbors > 0);
  auto mean_distance = all_mean_knn_distance(policy, points, options.neighbors, on_progress);
  if (!mean_distance) return fail(mean_distance.error());
  return detail::decide_statistically(points, *std::move(mean_distance), options);
}

/// The indices, ascending, of the points whose mean distance to their `neighbors` nearest neighbours
/// is at most mu + `sigma_multiplier` sigma, where mu and sigma are the mean and the standard
/// deviation of that distance over the cloud.
///
/// With `non_finite::keep` the selection is that of PCL 1.13's StatisticalOutlierRemoval on an
/// unorganised cloud, point for point. A cloud with k or fewer other points uses those there are; an
/// empty cloud gives an empty result, a single point is kept. O(n log n) for fixed k; the same result
/// for every policy. Coordinates are taken as float.
/// @pre neighbors > 0, fewer than 2^32 points
template <execution_policy Policy, point_range Points>
[[nodiscard]] std::vector<std::uint32_t> statistical_inliers(const Policy& policy, const Points& points,
                                                             const statistical_options& options = {}) {
  return statistical_filter(policy, points, options).inliers;
}

}  // namespace orbis::cloud

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Points whose surroundings are so many times sparser than usual.
///
/// Mean distances to neighbours are spread over orders of magnitude, with a long tail of outliers that
/// drags mean and standard deviation along. Their logarithms against the median are not dragged, and
/// the threshold is a factor: what counts as sparse does not depend on the unit or the size of the scene.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/cloud/extract.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud {

struct log_statistical_options {
  std::size_t neighbors = 8;  ///< k, the point itself not counted; > 0
  double threshold = 1.6;     ///< natural logarithm: outliers are exp(threshold) times sparser than the median
  cloud::non_finite non_finite = cloud::non_finite::drop;
};

/// The filter's decision, and what it is based on.
struct log_statistical_result {
  std::vector<std::uint32_t> inliers;  ///< indices, ascending
  std::vector<float> mean_distance;    ///< per point, metres; NaN where not finite or alone
  std::size_t judged = 0;              ///< points with a positive, finite mean distance: those that have a logarithm
  double median = 0;                   ///< of their logarithms
  double threshold = 0;                ///< log(mean distance) - median beyond this makes an outlier
  double threshold_distance = std::numeric_limits<double>::infinity();  ///< the same as a mean distance, metres
};

/// Decides on mean distances that are known already: see `log_statistical_inliers`. Points that have none
/// (NaN) are kept or dropped as `non_finite` says. O(n).
[[nodiscard]] log_statistical_result log_statistical_decision(std::vector<float> mean_distance,
                                                              const log_statistical_options& options = {});

namespace detail {

/// `log_statistical_filter` for any points.
template <execution_policy Policy>
[[nodiscard]] log_statistical_result filter_by_logarithm(const Policy& policy, const point_view& points,
                                                         const log_statistical_options& options);

}  // namespace detail

/// Finds the points that `log_statistical_inliers` returns, their scores and the threshold.
template <execution_policy Policy, point_range Points>
[[nodiscard]] log_statistical_result log_statistical_filter(const Policy& policy, const Points& points,
                                                            const log_statistical_options& options = {}) {
  assert(options.neighbors > 0);
  return detail::filter_by_logarithm(detail::threads_of(policy), detail::viewed_points{points}, options);
}

/// The indices, ascending, of the points whose mean distance to their `neighbors` nearest neighbours is
/// at most exp(`threshold`) times the median over the cloud. Points identical to all their neighbours stay; so
/// does a point that is alone. O(n log n) for fixed k; the same result for every policy.
/// @pre neighbors > 0, fewer than 2^32 points
template <execution_policy Policy, point_range Points>
[[nodiscard]] std::vector<std::uint32_t> log_statistical_inliers(const Policy& policy, const Points& points,
                                                                 const log_statistical_options& options = {}) {
  return log_statistical_filter(policy, points, options).inliers;
}

}  // namespace orbis::cloud

#ifndef ORBIS_COMPILED
#include <orbis/cloud/log_statistical-inl.hpp>
#endif

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Removal of points whose surroundings are sparser than usual by a given factor.
///
/// Mean neighbour distances are spread over orders of magnitude, with a long tail of outliers that biases mean and
/// standard deviation. Their logarithms relative to the median are robust, and the threshold is a factor, independent
/// of the unit and the size of the scene.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/cloud/extract.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud {

struct log_statistical_options {
  std::size_t neighbors = 8;  ///< k, not counting the point itself; > 0
  double threshold = 1.6;     ///< natural logarithm; outliers are over exp(threshold) times sparser than the median
  cloud::non_finite non_finite = cloud::non_finite::drop;
};

/// Decision of the filter, and the statistics on which it is based.
struct log_statistical_result {
  std::vector<std::uint32_t> inliers;  ///< indices, ascending
  std::vector<float> mean_distance;    ///< per point, metres; NaN for non-finite points and for a single point
  std::size_t judged = 0;              ///< number of points with a positive, finite mean distance
  double median = 0;                   ///< median of the logarithms of the positive, finite mean distances
  double threshold = 0;                ///< points with log(mean distance) - median above this are outliers
  double threshold_distance = std::numeric_limits<double>::infinity();  ///< the threshold as a mean distance, metres
};

/// Classifies points by known mean distances, see `log_statistical_inliers`. `non_finite` applies to points without a
/// mean distance (NaN). O(n).
ORBIS_LAZY [[nodiscard]] log_statistical_result log_statistical_decision(std::vector<float> mean_distance,
                                                                         const log_statistical_options& options = {});

namespace detail {

/// `log_statistical_filter` on a type-erased cloud.
template <execution_policy Policy>
[[nodiscard]] log_statistical_result filter_by_logarithm(const Policy& policy, const point_view& points,
                                                         const log_statistical_options& options);

}  // namespace detail

/// Finds the points that `log_statistical_inliers` returns, with their scores and the threshold.
template <execution_policy Policy, point_range Points>
[[nodiscard]] log_statistical_result log_statistical_filter(const Policy& policy, const Points& points,
                                                            const log_statistical_options& options = {}) {
  assert(options.neighbors > 0);
  return detail::filter_by_logarithm(detail::as_parallel(policy), detail::viewed_points{points}, options);
}

/// Returns the indices, ascending, of the points whose mean distance to their `neighbors` nearest neighbours is at most
/// exp(`threshold`) times the median over the cloud. Keeps points identical to all their neighbours, and a single
/// point. O(n log n) for fixed k; the same result for every policy.
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

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Statistical outlier removal: points whose mean distance to their neighbours is unusually large.
///
/// Source: R. B. Rusu, Z. C. Marton, N. Blodow, M. Dolha, M. Beetz, "Towards 3D point cloud based
/// object maps for household environments", Robotics and Autonomous Systems 56, 2008.
#pragma once

#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/cloud/mean_knn_distance.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/rounded.hpp>

namespace orbis::cloud {

/// What a filter does with points that are not finite. They never count in its statistics.
enum class non_finite {
  drop,  ///< they are outliers
  keep   ///< they are inliers, so that an organised cloud keeps its holes
};

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

/// Decides on mean distances that are known already: see `statistical_inliers`. O(n).
[[nodiscard]] inline statistical_result statistical_decision(std::vector<float> mean_distance,
                                                             const statistical_options& options = {}) {
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
  if (n > 1) out.standard_deviation = std::sqrt((sum_of_squares - sum * sum / count) / (count - 1));
  out.threshold = out.mean + rounded_product(options.sigma_multiplier, out.standard_deviation);
  out.mean_distance = std::move(mean_distance);
  return out;
}

/// The same as `statistical_inliers`, with the scores and the threshold.
template <execution_policy Policy, point_range Points>
[[nodiscard]] statistical_result statistical_filter(const Policy& policy, const Points& points,
                                                    const statistical_options& options = {}) {
  assert(options.neighbors > 0);
  statistical_result out = statistical_decision(all_mean_knn_distance(policy, points, options.neighbors), options);
  const auto first = std::ranges::begin(points);
  for (std::size_t i = 0; i != out.mean_distance.size(); ++i) {
    const bool finite =
        is_finite(coordinates<float>(first[static_cast<std::ranges::range_difference_t<const Points>>(i)]));
    const bool inlier =
        finite ? !(out.mean_distance[i] > out.threshold) : options.non_finite == cloud::non_finite::keep;
    if (inlier) out.inliers.push_back(static_cast<std::uint32_t>(i));
  }
  return out;
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

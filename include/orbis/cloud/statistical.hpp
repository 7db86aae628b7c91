// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Statistical outlier removal: removes points whose mean distance to their neighbours is unusually large compared with
/// the whole cloud (`statistical_inliers`) or for their range from the sensor (`range_statistical_inliers`).
///
/// The points of a depth camera or a scanner are `angle * r` apart at range r (`angle`: the angle between two rays),
/// and scatter along the ray by sigma(r) = `noise * r^2` (triangulation). The second filter divides a point's mean
/// distance by the spacing expected at its range, sqrt((angle r)^2 + (noise r^2)^2). The quotient has the same scale
/// over the whole cloud, so that a far wall is kept and outliers near the sensor are removed.
///
/// Sources: R. B. Rusu, Z. C. Marton, N. Blodow, M. Dolha, M. Beetz, "Towards 3D point cloud based
/// object maps for household environments", Robotics and Autonomous Systems 56, 2008. For the noise:
/// K. Khoshelham, S. O. Elberink, "Accuracy and resolution of Kinect depth data for indoor mapping
/// applications", Sensors 12, 2012. For a scanner, with a neighbourhood that grows with range: N. Charron, S. Phillips,
/// S. L. Waslander, "De-noising of lidar point clouds corrupted by snowfall", CRV 2018.
#pragma once

#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <orbis/cloud/all_knn.hpp>
#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/cloud/extract.hpp>
#include <orbis/cloud/sensor_origins.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud {

struct statistical_options {
  std::size_t neighbors = 50;     ///< k, not counting the point itself; > 0
  double sigma_multiplier = 1.0;  ///< alpha
  cloud::non_finite non_finite = cloud::non_finite::drop;
};

/// Decision of the filter, and the statistics it is based on.
struct statistical_result {
  std::vector<std::uint32_t> inliers;  ///< indices, ascending
  std::vector<float> mean_distance;    ///< per point, metres; NaN for non-finite points and for a single point
  double mean = 0;                     ///< mu of the mean distances, metres
  double standard_deviation = 0;       ///< sigma, with denominator n - 1
  double threshold = 0;                ///< mu + alpha sigma; points above it are outliers
};

/// Classifies points by known mean distances, see `statistical_inliers`. `non_finite` applies to points without a mean
/// distance (NaN). O(n).
///
/// The variance is a difference of sums, as in other implementations, and can be negative if all distances are nearly
/// equal. The spread of such a cloud cannot be measured: sigma is then reported as 0 and the threshold as infinite, and
/// all points are kept (as in PCL, where both are NaN and no distance is larger). If distances or their squares
/// overflow, sigma is infinite and all points are kept as well.
ORBIS_LAZY [[nodiscard]] statistical_result statistical_decision(std::vector<float> mean_distance,
                                                                 const statistical_options& options = {});

namespace detail {

/// `statistical_filter` on a type-erased cloud.
template <execution_policy Policy>
[[nodiscard]] statistical_result filter_statistically(const Policy& policy, const point_view& points,
                                                      const statistical_options& options);

}  // namespace detail

/// Finds the points that `statistical_inliers` returns, with their scores and the threshold.
template <execution_policy Policy, point_range Points>
[[nodiscard]] statistical_result statistical_filter(const Policy& policy, const Points& points,
                                                    const statistical_options& options = {}) {
  assert(options.neighbors > 0);
  return detail::filter_statistically(detail::as_parallel(policy), detail::viewed_points{points}, options);
}

/// Returns the indices, ascending, of the points whose mean distance to their `neighbors` nearest neighbours is at most
/// mu + `sigma_multiplier` sigma, where mu and sigma are the mean and the standard deviation of that distance over the
/// cloud.
///
/// With `non_finite::keep` the selection equals that of PCL 1.13's StatisticalOutlierRemoval on an unorganised cloud,
/// point for point. If there are k or fewer other points, all of them are used. An empty cloud gives an empty result; a
/// single point is kept. O(n log n) for fixed k; the same result for every policy. Coordinates are converted to float.
/// @pre neighbors > 0, fewer than 2^32 points
template <execution_policy Policy, point_range Points>
[[nodiscard]] std::vector<std::uint32_t> statistical_inliers(const Policy& policy, const Points& points,
                                                             const statistical_options& options = {}) {
  return statistical_filter(policy, points, options).inliers;
}

struct range_statistical_options {
  std::size_t neighbors = 50;     ///< k, not counting the point itself; > 0
  double sigma_multiplier = 1.0;  ///< alpha
  /// Angle between neighbouring rays, radians; 1 / fx for a camera. >= 0; `angle` and `noise` must not both be zero.
  double angle = 1.0 / 525.0;
  /// Depth noise sigma(r) / r^2, 1 / metre; the default is a Kinect's. Only its ratio to `angle` matters. >= 0
  double noise = 1.425e-3;
  double least_range = 0.1;  ///< lower limit of the range of a point, metres; > 0
  cloud::non_finite non_finite = cloud::non_finite::drop;
};

/// Spacing in metres that is expected at a range, given the angle between rays and the noise of the sensor.
[[nodiscard]] inline double explained_spacing(double range, const range_statistical_options& options) noexcept {
  const double r = range > options.least_range ? range : options.least_range;
  const double beside = options.angle * r;
  const double along = options.noise * r * r;
  return std::sqrt(beside * beside + along * along);
}

/// Decision of the filter, and the statistics it is based on.
struct range_statistical_result {
  std::vector<std::uint32_t> inliers;  ///< indices, ascending
  std::vector<float> normalised;       ///< mean distance / expected spacing per point; NaN if either is unknown
  std::size_t judged = 0;              ///< number of points with a finite quotient
  double mean = 0;                     ///< mu of the quotients
  double standard_deviation = 0;       ///< sigma, with denominator n - 1
  double threshold = std::numeric_limits<double>::infinity();  ///< mu + alpha sigma; points above it are outliers
};

/// Classifies points by known mean distances and ranges, see `range_statistical_inliers`. `non_finite` applies to
/// points without a mean distance (NaN); points that lack only the range are kept. O(n).
/// @pre ranges is as long as mean_distance; angle >= 0, noise >= 0 and not both zero; least_range > 0
ORBIS_LAZY [[nodiscard]] range_statistical_result range_statistical_decision(
    std::span<const float> mean_distance, std::span<const float> ranges, const range_statistical_options& options = {});

namespace detail {

/// `range_statistical_filter` on a type-erased cloud with known ranges.
template <execution_policy Policy>
[[nodiscard]] range_statistical_result filter_by_range(const Policy& policy, const point_view& points,
                                                       std::span<const float> ranges,
                                                       const range_statistical_options& options);

}  // namespace detail

/// Finds the points that `range_statistical_inliers` returns, with their scores and the threshold.
template <execution_policy Policy, point_range Points>
[[nodiscard]] range_statistical_result range_statistical_filter(const Policy& policy, const Points& points,
                                                                const sensor_origins& origins,
                                                                const range_statistical_options& options = {}) {
  assert(options.neighbors > 0);
  return detail::filter_by_range(detail::as_parallel(policy), detail::viewed_points{points},
                                 sensor_ranges(policy, points, origins), options);
}

/// Returns the indices, ascending, of the points whose mean distance to their `neighbors` nearest neighbours, divided
/// by the spacing expected at their range (`explained_spacing`), is at most mu + `sigma_multiplier` sigma of that
/// quotient over the cloud. Keeps points of unknown range, and hence all points if no range is known (`judged` is then
/// 0). O(n log n) for fixed k; the same result for every policy.
/// @pre neighbors > 0, fewer than 2^32 points; see `range_statistical_decision`
template <execution_policy Policy, point_range Points>
[[nodiscard]] std::vector<std::uint32_t> range_statistical_inliers(const Policy& policy, const Points& points,
                                                                   const sensor_origins& origins,
                                                                   const range_statistical_options& options = {}) {
  return range_statistical_filter(policy, points, origins, options).inliers;
}

}  // namespace orbis::cloud

#ifndef ORBIS_COMPILED
#include <orbis/cloud/statistical-inl.hpp>
#endif

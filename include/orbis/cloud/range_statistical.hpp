// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Statistical outlier removal where the sensor thins out and grows noisier with range.
///
/// The points of a depth camera or a scanner lie `angle * r` apart at range r (the angle between two
/// rays), and scatter along the ray by sigma(r) = `noise * r^2` (triangulation). A point's spacing is
/// therefore judged by what its range explains, sqrt((angle r)^2 + (noise r^2)^2): the quotient is of
/// one size over the whole cloud, so that the far wall does not go while outliers up close stay.
///
/// Source of the noise: K. Khoshelham, S. O. Elberink, "Accuracy and resolution of Kinect depth data for
/// indoor mapping applications", Sensors 12, 2012. A neighbourhood that grows with range for a scanner:
/// N. Charron, S. Phillips, S. L. Waslander, "De-noising of lidar point clouds corrupted by snowfall",
/// CRV 2018.
#pragma once

#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <orbis/cloud/decision.hpp>
#include <orbis/cloud/mean_knn_distance.hpp>
#include <orbis/cloud/sensor_origins.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud {

struct range_statistical_options {
  std::size_t neighbors = 50;     ///< k, the point itself not counted; > 0
  double sigma_multiplier = 1.0;  ///< alpha
  /// Between neighbouring rays, radians; for a camera 1 / fx. >= 0, and not zero together with `noise`.
  double angle = 1.0 / 525.0;
  /// sigma(r) / r^2, 1 / metre; the default is a Kinect's. Only its ratio to `angle` matters. >= 0
  double noise = 1.425e-3;
  double least_range = 0.1;  ///< closer points are judged as if they were here, metres; > 0
  cloud::non_finite non_finite = cloud::non_finite::drop;
};

/// The spacing in metres that the sensor explains at a range.
[[nodiscard]] inline double explained_spacing(double range, const range_statistical_options& options) noexcept {
  const double r = range > options.least_range ? range : options.least_range;
  const double beside = options.angle * r;
  const double along = options.noise * r * r;
  return std::sqrt(beside * beside + along * along);
}

/// The filter's decision, and what it is based on.
struct range_statistical_result {
  std::vector<std::uint32_t> inliers;  ///< indices, ascending
  std::vector<float> normalised;       ///< per point, spacing over explained spacing; NaN where either is not known
  std::size_t judged = 0;              ///< points where it is finite
  double mean = 0;                     ///< mu of those
  double standard_deviation = 0;       ///< sigma, with n - 1
  double threshold = std::numeric_limits<double>::infinity();  ///< mu + alpha sigma; points beyond are outliers
};

/// Decides on mean distances and ranges that are known already: see `range_statistical_inliers`. Points
/// without a mean distance (NaN) are kept or dropped as `non_finite` says; those without a range alone
/// stay. O(n).
/// @pre ranges is as long as mean_distance; angle >= 0, noise >= 0 and not both zero; least_range > 0
[[nodiscard]] inline range_statistical_result range_statistical_decision(
    std::span<const float> mean_distance, std::span<const float> ranges,
    const range_statistical_options& options = {}) {
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
    double squares = 0;  // about the mean: no cancellation
    for (const float u : out.normalised) {
      if (std::isfinite(u)) squares += (u - out.mean) * (u - out.mean);
    }
    if (out.judged > 1) out.standard_deviation = std::sqrt(squares / (count - 1));
    constexpr double rounding = 1 + 0x1p-20;  // of the scores: equal ones are all as usual
    out.threshold = out.mean * rounding + options.sigma_multiplier * out.standard_deviation;
  }
  out.inliers = detail::indices_where(mean_distance.size(), [&](std::size_t i) {
    if (std::isnan(mean_distance[i])) return options.non_finite == non_finite::keep;
    return !(double{out.normalised[i]} > out.threshold);
  });
  return out;
}

/// The same as `range_statistical_inliers`, with the scores and the threshold.
template <execution_policy Policy, point_range Points>
[[nodiscard]] range_statistical_result range_statistical_filter(const Policy& policy, const Points& points,
                                                                const sensor_origins& origins,
                                                                const range_statistical_options& options = {}) {
  assert(options.neighbors > 0);
  const std::vector<float> spacing = all_mean_knn_distance(policy, points, options.neighbors);
  const std::vector<float> ranges = sensor_ranges(policy, points, origins);
  range_statistical_result out = range_statistical_decision(spacing, ranges, options);
  out.inliers = detail::inliers_by_score(points, out.normalised, options.non_finite,
                                         [&](float u) { return double{u} > out.threshold; });
  return out;
}

/// The indices, ascending, of the points whose mean distance to their `neighbors` nearest neighbours,
/// divided by the spacing that the sensor explains at their range, is at most mu + `sigma_multiplier`
/// sigma of that quotient over the cloud. Points whose range is not known stay, all of them where none is
/// (`judged` is 0 then). O(n log n) for fixed k; the same result for every policy.
/// @pre neighbors > 0, fewer than 2^32 points; see `range_statistical_decision`
template <execution_policy Policy, point_range Points>
[[nodiscard]] std::vector<std::uint32_t> range_statistical_inliers(const Policy& policy, const Points& points,
                                                                   const sensor_origins& origins,
                                                                   const range_statistical_options& options = {}) {
  return range_statistical_filter(policy, points, origins, options).inliers;
}

}  // namespace orbis::cloud

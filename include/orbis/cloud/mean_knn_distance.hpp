// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The mean distance of every point to its k nearest neighbours.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <orbis/cloud/curve_order.hpp>
#include <orbis/cloud/nanoflann.hpp>
#include <orbis/cloud/squared_distance.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud {

namespace detail {

/// The squared distances of the `wanted` nearest points, each counted as often as it occurs.
class nearest_distances {
 public:
  /// `multiplicity`: of each point; empty where all are 1.
  nearest_distances(std::size_t wanted, std::span<const std::uint32_t> multiplicity)
      : wanted_{wanted}, multiplicity_{multiplicity}, found_(full + 3 * wanted) {}
  /// Starts a search among the points within `bound_squared`.
  void start(float bound_squared) {
    count_ = 0;
    bound_ = bound_squared;
  }
  [[nodiscard]] float bound_squared() const noexcept { return bound_; }
  bool add(std::uint32_t i, float distance_squared) {
    if (distance_squared > bound_) return true;
    if (multiplicity_.empty()) {
      found_[count_++] = distance_squared;
    } else {
      const std::size_t times = std::min<std::size_t>(multiplicity_[i], wanted_);
      std::fill_n(found_.begin() + static_cast<std::ptrdiff_t>(count_), times, distance_squared);
      count_ += times;
    }
    // Selecting now and then is cheaper than keeping a sorted list or a heap.
    if (count_ >= full + 2 * wanted_) trim();
    return true;
  }
  /// Leaves the wanted ones, in no particular order; false if there are fewer.
  [[nodiscard]] bool finish() {
    if (count_ < wanted_) return false;
    trim();
    return true;
  }
  [[nodiscard]] std::span<float> nearest() noexcept { return {found_.data(), count_}; }

 private:
  static constexpr std::size_t full = 8;

  void trim() {
    const auto last = found_.begin() + static_cast<std::ptrdiff_t>(wanted_ - 1);
    std::nth_element(found_.begin(), last, found_.begin() + static_cast<std::ptrdiff_t>(count_));
    count_ = wanted_;
    bound_ = *last;
  }

  std::size_t wanted_;
  std::span<const std::uint32_t> multiplicity_;
  std::vector<float> found_;
  std::size_t count_ = 0;
  float bound_ = 0;
};

/// `float(sum / divisor)`, where `sum` adds the roots in ascending order in double. The order only
/// matters where a rounding border of float lies within the error of the sum, so they are sorted
/// only there.
[[nodiscard]] inline float mean_root(std::span<float> squared, double divisor) {
  double sum = 0;
  for (const float s : squared) sum += std::sqrt(double{s});
  const double slack = 4.0 * static_cast<double>(squared.size()) * std::numeric_limits<double>::epsilon();
  const auto low = static_cast<float>(sum * (1 - slack) / divisor);
  const auto high = static_cast<float>(sum * (1 + slack) / divisor);
  if (low == high) return low;
  std::sort(squared.begin(), squared.end());
  sum = 0;
  for (const float s : squared) sum += std::sqrt(double{s});
  return static_cast<float>(sum / divisor);
}

}  // namespace detail

/// For each point the mean distance in metres to its `k` nearest other points; to all others where
/// there are fewer than `k`. NaN for points that are not finite, and for a point that is alone.
///
/// Coordinates are taken as float. Squared distances are float, roots and sums double in ascending
/// order, the mean float: bit for bit the mean distances of the usual statistical outlier filter.
/// O(n log n) for fixed k, also where many points are identical; the same result for every policy.
/// @pre k > 0, fewer than 2^32 points
template <execution_policy Policy, point_range Points>
[[nodiscard]] std::vector<float> all_mean_knn_distance(const Policy& policy, const Points& points, std::size_t k) {
  assert(k > 0);
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> means(std::ranges::size(points), nan);
  const ordered_cloud cloud = order_along_curve(policy, points);
  const std::size_t wanted = std::min(k, cloud.finite == 0 ? 0 : cloud.finite - 1) + 1;  // with the point itself
  if (wanted < 2) return means;

  const nanoflann_search search{cloud.positions};
  std::vector<float> of_position(cloud.positions.size());
  std::span<const std::uint32_t> multiplicity;
  if (cloud.positions.size() != cloud.finite) multiplicity = cloud.multiplicity;
  for_each_chunk(policy, cloud.positions.size(), 1024, [&](std::size_t begin, std::size_t end) {
    detail::nearest_distances nearest{wanted, multiplicity};
    // The previous point's search bounds this one's: all that was near that point is at most the
    // step further away. Most often a little more than the previous radius is enough.
    constexpr float none = std::numeric_limits<float>::infinity();
    constexpr float likely = 1.15F;
    float certain = none;
    float hoped = none;
    for (std::size_t i = begin; i != end; ++i) {
      bool enough = false;
      for (const float bound : {std::min(hoped, certain), certain, none}) {
        nearest.start(bound);
        search.visit(cloud.positions[i], nearest);
        enough = nearest.finish();
        if (enough || bound == none) break;
      }
      if (!enough) {  // only where squared distances overflow
        of_position[i] = hoped = certain = none;
        continue;
      }
      if (i + 1 != end) {
        const float radius = std::sqrt(nearest.bound_squared());
        const float reach = radius + std::sqrt(squared_distance(cloud.positions[i], cloud.positions[i + 1]));
        certain = reach * reach * 1.00001F;
        hoped = radius * radius * likely * likely;
      }
      of_position[i] = detail::mean_root(nearest.nearest(), static_cast<double>(wanted - 1));
    }
  });
  cloud.for_each_member([&](std::size_t position, std::uint32_t i) { means[i] = of_position[position]; });
  return means;
}

}  // namespace orbis::cloud

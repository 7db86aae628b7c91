// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Radius outlier removal: points with too few neighbours close by.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/cloud/curve_order.hpp>
#include <orbis/cloud/nanoflann.hpp>
#include <orbis/cloud/statistical.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud {

struct radius_options {
  double radius = 0.05;           ///< metres, the border included; >= 0
  std::size_t min_neighbors = 5;  ///< the point itself not counted
  cloud::non_finite non_finite = cloud::non_finite::drop;
};

namespace detail {

/// Counts points within a radius, until there are enough.
class neighbor_count {
 public:
  neighbor_count(float radius, std::size_t enough, std::span<const std::uint32_t> multiplicity)
      : bound_{radius * radius}, enough_{enough}, multiplicity_{multiplicity} {}
  void start() { count_ = 0; }
  [[nodiscard]] float bound_squared() const noexcept { return bound_; }
  bool add(std::uint32_t i, float distance_squared) {
    if (distance_squared <= bound_) count_ += multiplicity_[i];
    return count_ < enough_;
  }
  [[nodiscard]] bool reached() const noexcept { return count_ >= enough_; }

 private:
  float bound_;
  std::size_t enough_;
  std::size_t count_ = 0;
  std::span<const std::uint32_t> multiplicity_;
};

}  // namespace detail

/// The indices, ascending, of the points with at least `min_neighbors` other points within `radius`.
/// O(n (log n + min_neighbors)); the same result for every policy. Coordinates are taken as float.
/// @pre radius >= 0, fewer than 2^32 points
template <execution_policy Policy, point_range Points>
[[nodiscard]] std::vector<std::uint32_t> radius_inliers(const Policy& policy, const Points& points,
                                                        const radius_options& options = {}) {
  assert(options.radius >= 0);
  const ordered_cloud cloud = order_along_curve(policy, points);
  const nanoflann_search search{cloud.positions};
  std::vector<char> kept(std::ranges::size(points), options.non_finite == cloud::non_finite::keep ? 1 : 0);
  std::vector<char> position_kept(cloud.positions.size(), 0);
  for_each_chunk(policy, cloud.positions.size(), 1024, [&](std::size_t begin, std::size_t end) {
    // The search finds the point itself too.
    detail::neighbor_count count{static_cast<float>(options.radius), options.min_neighbors + 1, cloud.multiplicity};
    for (std::size_t i = begin; i != end; ++i) {
      count.start();
      search.visit(cloud.positions[i], count);
      position_kept[i] = count.reached() ? 1 : 0;
    }
  });
  cloud.for_each_member([&](std::size_t position, std::uint32_t i) { kept[i] = position_kept[position]; });
  std::vector<std::uint32_t> inliers;
  for (std::size_t i = 0; i != kept.size(); ++i) {
    if (kept[i] != 0) inliers.push_back(static_cast<std::uint32_t>(i));
  }
  return inliers;
}

}  // namespace orbis::cloud

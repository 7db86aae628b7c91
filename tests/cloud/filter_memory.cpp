// SPDX-License-Identifier: BSD-3-Clause
//
// How much memory the filters hold at a time, for each point.
#include <cstddef>
#include <utility>
#include <vector>

#include <orbis/cloud/cluster.hpp>
#include <orbis/cloud/detail/knn/leaf_hierarchy.hpp>
#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/cloud/log_statistical.hpp>
#include <orbis/cloud/select.hpp>
#include <orbis/cloud/statistical.hpp>
#include <orbis/core/execution.hpp>

#include "cloud/clouds.hpp"
#include "support/allocations.hpp"
#include "support/catch.hpp"

namespace {

/// The most bytes for each point that `f` holds at a time, its result included.
template <class F>
double bytes_per_point(std::size_t points, F&& f) {
  const std::size_t before = orbis::test::bytes_held();
  orbis::test::begin_peak();
  const auto result = std::forward<F>(f)();
  return static_cast<double>(orbis::test::peak_bytes_held() - before) / static_cast<double>(points);
}

}  // namespace

TEST_CASE("filters hold no list of the neighbours of all points") {
  if (!orbis::test::counts_allocations()) return;
  orbis::test::points cloud = orbis::test::room_cloud(500, 400, 0.001, 1);
  orbis::random_bits random{2};
  for (int i = 0; i != 2000; ++i) {
    const double x = random.uniform(-1.4, 1.8);
    const double y = random.uniform(-1.1, 1.1);
    cloud.emplace_back(orbis::vec3{x, y, random.uniform(0.4, 3.3)}.cast<float>());
  }
  std::vector<float> ranges;
  for (const auto& p : cloud) ranges.push_back(p.norm());
  const auto policy = orbis::par.with(2);
  const std::size_t n = cloud.size();
  CHECK(bytes_per_point(n, [&] {
          return orbis::cloud::detail::make_leaves(policy, orbis::cloud::detail::viewed_points{cloud}, 51);
        }) < 18.5);
  // Twelve neighbours as a table are 96 bytes.
  CHECK(bytes_per_point(n, [&] { return orbis::cloud::filter_automatically(policy, cloud, {.ranges = ranges}); }) <
        75.0);
  CHECK(bytes_per_point(n, [&] { return orbis::cloud::cluster_filter(policy, cloud); }) < 75.0);
  CHECK(bytes_per_point(n, [&] { return orbis::cloud::statistical_filter(policy, cloud, {.neighbors = 50}); }) < 40.0);
  CHECK(bytes_per_point(n, [&] { return orbis::cloud::log_statistical_filter(policy, cloud); }) < 40.0);
}

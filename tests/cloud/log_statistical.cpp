// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

#include <orbis/cloud/log_statistical.hpp>

#include "cloud/clouds.hpp"
#include "cloud/reference.hpp"
#include "support/catch.hpp"

using orbis::cloud::log_statistical_decision;
using orbis::cloud::log_statistical_filter;
using orbis::cloud::log_statistical_inliers;
using orbis::cloud::non_finite;

TEST_CASE("the logarithmic filter keeps what is not sparser than so many times the median") {
  for (const auto& [name, cloud] : orbis::test::all_clouds()) {
    for (const std::size_t k : {1U, 8U}) {
      INFO(name << " k " << k);
      const auto distances = orbis::test::reference_mean_distances(cloud, k);
      std::vector<double> logs;
      for (const float d : distances) {
        if (d > 0 && std::isfinite(d)) logs.push_back(std::log(static_cast<double>(d)));
      }
      std::sort(logs.begin(), logs.end());
      const double median = logs.empty() ? 0 : logs[(logs.size() - 1) / 2];
      for (const auto policy : {non_finite::drop, non_finite::keep}) {
        std::vector<std::uint32_t> expected;
        for (std::uint32_t i = 0; i != cloud.size(); ++i) {
          const bool finite = orbis::test::finite(cloud[i]);
          const bool sparse = distances[i] > 0 && std::log(static_cast<double>(distances[i])) - median > 0.7;
          if (finite ? !sparse : policy == non_finite::keep) expected.push_back(i);
        }
        const auto found =
            log_statistical_filter(orbis::par, cloud, {.neighbors = k, .threshold = 0.7, .non_finite = policy});
        CHECK(found.inliers == expected);
        CHECK(found.judged == logs.size());
        CHECK(found.median == median);
        CHECK(log_statistical_inliers(orbis::par.with(3), cloud,
                                      {.neighbors = k, .threshold = 0.7, .non_finite = policy}) == found.inliers);
      }
    }
  }
}

TEST_CASE("equal spacings are all usual") {
  orbis::test::points grid;
  for (int x = 0; x != 20; ++x)
    for (int y = 0; y != 20; ++y) grid.emplace_back(0.1F * static_cast<float>(x), 0.1F * static_cast<float>(y), 7.3F);
  const auto result = log_statistical_filter(orbis::seq, grid, {.neighbors = 3, .threshold = 0.03});
  CHECK(result.inliers.size() >= grid.size() - 4);  // at the corners the third neighbour is further
}

TEST_CASE("spacings without a logarithm are no outliers unless infinite") {
  constexpr float inf = std::numeric_limits<float>::infinity();
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> distances{0, 0, 0, 1, 1, 1.1F, inf, nan, 50};
  const auto dropped = log_statistical_decision(distances);
  CHECK(dropped.judged == 4);
  CHECK(dropped.inliers == std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5});
  const auto kept = log_statistical_decision(distances, {.non_finite = non_finite::keep});
  CHECK(kept.inliers == std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5, 7});
  CHECK(log_statistical_decision({}).inliers.empty());
  CHECK(log_statistical_decision({0, 0}).inliers == std::vector<std::uint32_t>{0, 1});
  CHECK(log_statistical_inliers(orbis::seq, std::vector<orbis::vec3f>{{1, 2, 3}}) == std::vector<std::uint32_t>{0});
}

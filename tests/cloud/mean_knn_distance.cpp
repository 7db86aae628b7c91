// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include <orbis/cloud/mean_knn_distance.hpp>

#include "cloud/clouds.hpp"
#include "cloud/reference.hpp"
#include "support/catch.hpp"

TEST_CASE("mean neighbour distances equal brute force bit for bit") {
  for (const auto& [name, cloud] : orbis::test::all_clouds()) {
    for (const std::size_t k : {1U, 8U, 51U}) {
      INFO(name << " k " << k);
      const auto expected = orbis::test::reference_mean_distances(cloud, k);
      const auto found = orbis::cloud::all_mean_knn_distance(orbis::par.with(2), cloud, k);
      REQUIRE(found.size() == expected.size());
      std::size_t different = 0;
      for (std::size_t i = 0; i != found.size(); ++i) {
        const bool same = std::isnan(expected[i]) ? std::isnan(found[i]) : found[i] == expected[i];
        if (!same) ++different;
      }
      CHECK(different == 0);
    }
  }
}

TEST_CASE("the mean of roots does not depend on the order of the distances") {
  orbis::random_bits random{3};
  for (int round = 0; round != 2000; ++round) {
    std::vector<float> squares;
    for (int i = 0; i != 51; ++i) squares.push_back(static_cast<float>(random.uniform(0.0, 1e-3)));
    std::vector<float> sorted = squares;
    std::sort(sorted.begin(), sorted.end());
    double sum = 0;
    for (const float s : sorted) sum += std::sqrt(double{s});
    CHECK(orbis::cloud::detail::mean_root(squares, 50.0) == static_cast<float>(sum / 50.0));
  }
}

TEST_CASE("one table of neighbours gives the mean distances of every smaller k") {
  for (const auto& [name, cloud] : orbis::test::all_clouds()) {
    const auto table = orbis::cloud::all_knn(orbis::par.with(2), cloud, 20);
    CHECK(table.points == cloud.size());
    for (const std::size_t k : {1U, 8U, 20U, 90U}) {
      INFO(name << " k " << k);
      const auto expected = orbis::cloud::all_mean_knn_distance(orbis::seq, cloud, std::min<std::size_t>(k, 20));
      const auto found = orbis::cloud::mean_knn_distance(table, k);
      REQUIRE(found.size() == expected.size());
      std::size_t different = 0;
      for (std::size_t i = 0; i != found.size(); ++i) {
        const bool same =
            std::isnan(expected[i]) ? std::isnan(found[i]) : std::abs(found[i] - expected[i]) <= 2e-7F * expected[i];
        if (!same) ++different;
      }
      CHECK(different == 0);
      const auto together = orbis::cloud::mean_knn_distance(orbis::par.with(3), table, k);
      CHECK(std::equal(found.begin(), found.end(), together.begin(), together.end(),
                       [](float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); }));
    }
  }
}

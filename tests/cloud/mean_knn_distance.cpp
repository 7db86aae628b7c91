// SPDX-License-Identifier: BSD-3-Clause
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

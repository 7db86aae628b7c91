// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include <orbis/cloud/voxel_grid.hpp>

#include "cloud/clouds.hpp"
#include "cloud/reference.hpp"
#include "support/catch.hpp"

TEST_CASE("a voxel grid gives the centroids in the order of first sight") {
  for (const auto& [name, cloud] : orbis::test::all_clouds()) {
    INFO(name);
    const double size = 0.07;
    std::map<std::array<double, 3>, std::size_t> number;
    std::vector<orbis::vec3> sums;
    std::vector<double> counts;
    for (const auto& p : cloud) {
      if (!orbis::test::finite(p)) continue;
      const std::array<double, 3> cell{std::floor(p.x() * (1 / size)), std::floor(p.y() * (1 / size)),
                                       std::floor(p.z() * (1 / size))};
      const auto [at, is_new] = number.try_emplace(cell, sums.size());
      if (is_new) {
        sums.emplace_back(orbis::vec3::Zero());
        counts.push_back(0);
      }
      sums[at->second] += p.cast<double>();
      counts[at->second] += 1;
    }
    const orbis::point_cloud grid = orbis::cloud::voxel_grid(cloud, {.size = size});
    REQUIRE(grid.size() == sums.size());
    CHECK(grid.colors.empty());
    for (std::size_t i = 0; i != sums.size(); ++i) {
      CHECK((grid.points[i] - (sums[i] / counts[i]).cast<float>()).norm() <= 1e-6F * grid.points[i].norm());
    }
  }
}

TEST_CASE("colours are averaged over a voxel") {
  const orbis::point_cloud cloud{{{0.1F, 0.1F, 0.1F}, {0.9F, 0.9F, 0.9F}, {-0.1F, 0.1F, 0.1F}},
                                 {{10, 0, 255}, {21, 100, 255}, {7, 8, 9}}};
  const orbis::point_cloud grid = orbis::cloud::voxel_grid(cloud, {.size = 1.0});
  REQUIRE(grid.size() == 2);
  CHECK(grid.colors[0] == orbis::rgb8{16, 50, 255});  // 15.5 rounds up
  CHECK(grid.colors[1] == orbis::rgb8{7, 8, 9});
  CHECK(grid.points[0].isApprox(orbis::vec3f{0.5F, 0.5F, 0.5F}));
}

TEST_CASE("points beyond the voxel keys are left out") {
  const std::vector<orbis::vec3f> cloud{{1e30F, 0, 0}, {0, 0, 0}, {0, std::numeric_limits<float>::quiet_NaN(), 0}};
  CHECK(orbis::cloud::voxel_grid(cloud, {.size = 0.01}).size() == 1);
}

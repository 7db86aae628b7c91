// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
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

TEST_CASE("one point of each voxel stands for it, by index") {
  using orbis::cloud::voxel_first;
  using orbis::cloud::voxel_grid_indices;
  using orbis::cloud::voxel_random;
  for (const auto& [name, cloud] : orbis::test::all_clouds()) {
    INFO(name);
    const double size = 0.07;
    std::map<std::array<double, 3>, std::vector<std::uint32_t>> members;
    std::vector<std::array<double, 3>> seen;
    for (std::uint32_t i = 0; i != cloud.size(); ++i) {
      const auto& p = cloud[i];
      if (!orbis::test::finite(p)) continue;
      const std::array<double, 3> cell{std::floor(p.x() * (1 / size)), std::floor(p.y() * (1 / size)),
                                       std::floor(p.z() * (1 / size))};
      auto& of_cell = members[cell];
      if (of_cell.empty()) seen.push_back(cell);
      of_cell.push_back(i);
    }
    const auto first = voxel_grid_indices(cloud, {.size = size});
    const auto random = voxel_grid_indices(cloud, {.size = size}, voxel_random{.seed = 5});
    REQUIRE(first.size() == seen.size());
    REQUIRE(random.size() == seen.size());
    for (std::size_t v = 0; v != seen.size(); ++v) {
      const auto& of_cell = members[seen[v]];
      CHECK(first[v] == of_cell.front());
      CHECK(std::count(of_cell.begin(), of_cell.end(), random[v]) == 1);
    }
    CHECK(voxel_grid_indices(cloud, {.size = size}, voxel_random{.seed = 5}) == random);
    const auto points = orbis::cloud::voxel_grid(cloud, {.size = size}, voxel_first{});
    REQUIRE(points.size() == first.size());
    for (std::size_t v = 0; v != first.size(); ++v) CHECK(points.points[v] == cloud[first[v]]);
  }
}

TEST_CASE("a random point of a voxel is any of them, evenly") {
  const orbis::test::points cloud = orbis::test::uniform_cloud(8, 1);
  std::array<int, 8> chosen{};
  for (std::uint64_t seed = 0; seed != 4000; ++seed) {
    const auto indices =
        orbis::cloud::voxel_grid_indices(cloud, {.size = 1.0}, orbis::cloud::voxel_random{.seed = seed});
    REQUIRE(indices.size() == 1);
    ++chosen[indices[0]];
  }
  for (const int n : chosen) CHECK(std::abs(n - 500) < 100);  // 4.8 standard deviations
}

TEST_CASE("colours ride along, and the choice may be anyone's") {
  const orbis::point_cloud cloud{{{0.1F, 0.1F, 0.1F}, {0.9F, 0.9F, 0.9F}, {-0.1F, 0.1F, 0.1F}},
                                 {{10, 0, 255}, {21, 100, 255}, {7, 8, 9}}};
  const auto first = orbis::cloud::voxel_grid(cloud, {.size = 1.0}, orbis::cloud::voxel_first{});
  REQUIRE(first.size() == 2);
  CHECK(first.points[0] == cloud.points[0]);
  CHECK(first.colors[0] == cloud.colors[0]);
  CHECK(first.colors[1] == cloud.colors[2]);
  struct last {
    static bool replaces(std::uint32_t /*kept*/, std::uint32_t /*candidate*/) { return true; }
  };
  const auto chosen = orbis::cloud::voxel_grid(cloud.points, cloud.colors, {.size = 1.0}, last{});
  CHECK(chosen.colors == std::vector<orbis::rgb8>{cloud.colors[1], cloud.colors[2]});
  const auto random = orbis::cloud::voxel_grid(cloud, {.size = 1.0}, orbis::cloud::voxel_random{});
  CHECK(random.colors.size() == 2);
}

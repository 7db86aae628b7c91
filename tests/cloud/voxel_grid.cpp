// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include <orbis/cloud/voxel_grid.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/random.hpp>

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

namespace {

/// What `voxel_grid` and `voxel_grid_indices` with `voxel_random` must give, bit by bit.
struct expected_voxels {
  orbis::point_cloud centroids;
  std::vector<std::uint32_t> first;
  std::vector<std::uint32_t> random;
};
template <class Points>
[[nodiscard]] expected_voxels voxels_one_by_one(const Points& points, std::span<const orbis::rgb8> colors,
                                                double size) {
  orbis::cloud::voxel_accumulator voxels{size};
  expected_voxels out;
  for (std::uint32_t i = 0; i != points.size(); ++i) {
    const auto number = voxels.add(points[i], colors.empty() ? orbis::rgb8{} : colors[i]);
    if (!number) continue;
    if (*number == out.first.size()) {
      out.first.push_back(i);
      out.random.push_back(i);
    } else if (orbis::cloud::voxel_random{.seed = 3}.replaces(out.random[*number], i)) {
      out.random[*number] = i;
    }
  }
  out.centroids = voxels.centroids(!colors.empty());
  return out;
}

template <class Points>
void check_voxels(const Points& points, std::span<const orbis::rgb8> colors, double size) {
  using orbis::cloud::voxel_random;
  const expected_voxels expected = voxels_one_by_one(points, colors, size);
  const orbis::cloud::voxel_grid_options options{.size = size};
  const auto check = [&](const auto& policy) {
    const orbis::point_cloud grid = orbis::cloud::voxel_grid(policy, points, colors, options);
    CHECK(grid.points == expected.centroids.points);
    CHECK(grid.colors == expected.centroids.colors);
    CHECK(orbis::cloud::voxel_grid(policy, points, options).points == expected.centroids.points);
    CHECK(orbis::cloud::voxel_grid_indices(policy, points, options) == expected.first);
    CHECK(orbis::cloud::voxel_grid_indices(policy, points, options, voxel_random{.seed = 3}) == expected.random);
  };
  check(orbis::seq);
  check(orbis::par.with(2));
  check(orbis::par.with(5));
}

}  // namespace

TEST_CASE("a large cloud has the same voxels under every policy") {
  // On both sides of the sizes and shares of occupied voxels at which the way to them changes.
  for (const std::size_t n : {1'000U, 4'096U, 4'097U, 131'072U, 131'073U}) {
    orbis::test::points cloud = orbis::test::uniform_cloud(n, n, 3.0, -1.0);
    for (std::size_t i = 0; i < n; i += 97) cloud[i].y() = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t i = 1; i < n; i += 1013) cloud[i].z() = 3e8F;
    for (std::size_t i = 2; i < n; i += 1013) cloud[i].x() = -std::numeric_limits<float>::infinity();
    std::vector<orbis::rgb8> colors(n);
    orbis::random_bits random{n};
    for (orbis::rgb8& c : colors) {
      const auto bits = random();
      c = {static_cast<std::uint8_t>(bits), static_cast<std::uint8_t>(bits >> 8U),
           static_cast<std::uint8_t>(bits >> 16U)};
    }
    for (const double size : {0.01, 0.08, 0.15, 0.6, 100.0}) {
      INFO(n << " points, voxels of " << size);
      check_voxels(cloud, colors, size);
    }
  }
}

TEST_CASE("few voxels at first and many later") {
  // So that a table grows, and so that one table is given up for many.
  for (const auto& [near, far] : {std::pair{40'000U, 60'000U}, std::pair{150'000U, 150'000U}}) {
    orbis::test::points cloud = orbis::test::uniform_cloud(near, 1, 0.1);
    const orbis::test::points wide = orbis::test::uniform_cloud(far, 2, 5.0, -2.5);
    cloud.insert(cloud.end(), wide.begin(), wide.end());
    check_voxels(cloud, {}, 0.05);
    check_voxels(cloud, {}, 0.2);
  }
}

TEST_CASE("the voxels of points in double precision") {
  std::vector<std::array<double, 3>> cloud;
  orbis::random_bits random{8};
  for (int i = 0; i != 50'000; ++i)
    cloud.push_back({4e5 + random.uniform(), 5e6 + random.uniform(), random.uniform()});  // as on a map
  cloud[17][1] = std::numeric_limits<double>::quiet_NaN();
  cloud[18][2] = 1e300;
  for (const double size : {0.01, 0.3}) check_voxels(cloud, {}, size);
}

TEST_CASE("a large cloud at one place or without any finite point") {
  check_voxels(orbis::test::points(50'000, orbis::vec3f{0.1F, -0.2F, 3.0F}), {}, 0.01);
  check_voxels(orbis::test::points(50'000, orbis::vec3f::Constant(std::numeric_limits<float>::infinity())), {}, 0.01);
}

TEST_CASE("cells up to 2^31 from the origin are told apart") {
  using limits = std::numeric_limits<double>;
  const std::vector<std::array<double, 3>> cloud{{2147483646.5, 0, 0},
                                                 {2147483647.0, 0, 0},
                                                 {-2147483646.0, 0, 0},
                                                 {-2147483646.5, 0, 0},
                                                 {1e12, 0, 0},
                                                 {-1e12, 0, 0},
                                                 {limits::max(), 0, 0},
                                                 {0, limits::lowest(), 0},
                                                 {-0.0, -limits::denorm_min(), 0},
                                                 {0, -0.0, limits::denorm_min()}};
  check_voxels(cloud, {}, 1.0);
  CHECK(orbis::cloud::voxel_grid_indices(cloud, {.size = 1.0}) == std::vector<std::uint32_t>{0, 2, 8, 9});
}

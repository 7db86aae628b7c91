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

namespace {

/// What `voxel_grid` must give, bit by bit.
template <class Points>
[[nodiscard]] orbis::point_cloud voxels_one_by_one(const Points& points, std::span<const orbis::rgb8> colors,
                                                   double size) {
  struct sum {
    std::array<double, 3> position{};
    std::array<std::uint64_t, 3> color{};
    std::uint32_t count = 0;
  };
  std::map<std::array<double, 3>, std::size_t> numbers;
  std::vector<sum> sums;
  for (std::size_t i = 0; i != points.size(); ++i) {
    const auto p = orbis::coordinates<double>(points[i]);
    std::array<double, 3> cell{};
    bool is_cell = true;
    for (std::size_t a = 0; a != 3; ++a) {
      cell[a] = std::floor(p[a] * (1.0 / size)) + 0.0;
      is_cell = is_cell && std::abs(cell[a]) < 2147483647.0;
    }
    if (!is_cell) continue;
    const std::size_t number = numbers.try_emplace(cell, sums.size()).first->second;
    if (number == sums.size()) sums.emplace_back();
    sum& s = sums[number];
    for (std::size_t a = 0; a != 3; ++a) s.position[a] += p[a];
    ++s.count;
    if (colors.empty()) continue;
    s.color[0] += colors[i].r;
    s.color[1] += colors[i].g;
    s.color[2] += colors[i].b;
  }
  orbis::point_cloud out;
  for (const sum& s : sums) {
    const auto mean = [&](std::size_t a) { return static_cast<float>(s.position[a] / s.count); };
    const auto channel = [&](std::size_t a) { return static_cast<std::uint8_t>((s.color[a] + s.count / 2) / s.count); };
    out.points.emplace_back(mean(0), mean(1), mean(2));
    if (!colors.empty()) out.colors.push_back({channel(0), channel(1), channel(2)});
  }
  return out;
}

template <class Points>
void check_voxels(const Points& points, std::span<const orbis::rgb8> colors, double size) {
  const orbis::point_cloud expected = voxels_one_by_one(points, colors, size);
  const orbis::cloud::voxel_grid_options options{.size = size};
  const auto check = [&](const auto& policy) {
    const orbis::point_cloud grid = orbis::cloud::voxel_grid(policy, points, colors, options);
    CHECK(grid.points == expected.points);
    CHECK(grid.colors == expected.colors);
    CHECK(orbis::cloud::voxel_grid(policy, points, options).points == expected.points);
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
  CHECK(orbis::cloud::voxel_grid(cloud, {.size = 1.0}).size() == 4);
}

// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <vector>

#include <orbis/cloud/radius.hpp>
#include <orbis/core/simd/level.hpp>

#include "cloud/clouds.hpp"
#include "cloud/reference.hpp"
#include "support/catch.hpp"

using orbis::cloud::radius_inliers;

TEST_CASE("the radius filter keeps the points with enough others around them") {
  for (const auto& [name, cloud] : orbis::test::all_clouds()) {
    for (const double radius : {0.0, 0.05, 0.3}) {
      for (const std::size_t least : {0U, 1U, 6U}) {
        INFO(name << " radius " << radius << " least " << least);
        const auto r = static_cast<float>(radius);
        std::vector<std::uint32_t> expected;
        for (std::uint32_t i = 0; i != cloud.size(); ++i) {
          if (!orbis::test::finite(cloud[i])) continue;
          std::size_t others = 0;
          for (std::uint32_t j = 0; j != cloud.size(); ++j) {
            if (j != i && orbis::test::finite(cloud[j]) && orbis::test::squared(cloud[i], cloud[j]) <= r * r) ++others;
          }
          if (others >= least) expected.push_back(i);
        }
        for (const auto level : {orbis::simd::level::portable, orbis::simd::level::avx2, orbis::simd::level::avx512}) {
          const orbis::simd::level_limit limit{level};
          CHECK(radius_inliers(orbis::seq, cloud, {.radius = radius, .min_neighbors = least}) == expected);
        }
        CHECK(radius_inliers(orbis::par.with(3), cloud, {.radius = radius, .min_neighbors = least}) == expected);
      }
    }
  }
}

TEST_CASE("the radius filter keeps the holes of an organised cloud on request") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<orbis::vec3f> cloud{{nan, 0, 0}, {0, 0, 0}, {0.01F, 0, 0}, {5, 5, 5}};
  CHECK(radius_inliers(orbis::seq, cloud, {.radius = 0.02, .min_neighbors = 1}) == std::vector<std::uint32_t>{1, 2});
  CHECK(radius_inliers(orbis::seq, cloud,
                       {.radius = 0.02, .min_neighbors = 1, .non_finite = orbis::cloud::non_finite::keep}) ==
        std::vector<std::uint32_t>{0, 1, 2});
}

TEST_CASE("the radius filter takes hard clouds as well") {
  auto hard = orbis::test::all_clouds().back().second;
  for (std::size_t i = 0; i < hard.size(); i += 3) hard[i] *= 1e30F;  // squares overflow
  for (int i = 0; i != 90; ++i) hard.push_back(hard[4]);
  orbis::random_bits random{3};
  orbis::test::points scattered = orbis::test::uniform_cloud(4000, 5);
  for (std::size_t i = 0; i < scattered.size(); i += 7) scattered[i] = scattered[random.below(50)];
  for (const auto& cloud : {hard, scattered}) {
    for (const double radius : {1e-3, 0.1, 30.0, 1e25}) {
      for (const std::size_t least : {1U, 40U, 5000U}) {
        INFO(radius << " " << least);
        const auto r = static_cast<float>(radius);
        std::vector<std::uint32_t> expected;
        for (std::uint32_t i = 0; i != cloud.size(); ++i) {
          std::size_t others = 0;
          for (std::uint32_t j = 0; j != cloud.size() && others != least; ++j) {
            if (j != i && orbis::test::squared(cloud[i], cloud[j]) <= r * r) ++others;
          }
          if (others >= least) expected.push_back(i);
        }
        CHECK(radius_inliers(orbis::par.with(2), cloud, {.radius = radius, .min_neighbors = least}) == expected);
      }
    }
  }
}

TEST_CASE("identical points do not take quadratic time in the radius filter") {
  const std::vector<orbis::vec3f> identical(200'000, orbis::vec3f{0.5F, 0.5F, 0.5F});
  CHECK(radius_inliers(orbis::seq, identical, {.radius = 0.0, .min_neighbors = 100}).size() == identical.size());
}

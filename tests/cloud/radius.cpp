// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <vector>

#include <orbis/cloud/radius.hpp>

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
        CHECK(radius_inliers(orbis::seq, cloud, {.radius = radius, .min_neighbors = least}) == expected);
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

// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/cloud/extract.hpp>

#include "support/catch.hpp"

TEST_CASE("extraction takes points and colours along") {
  const orbis::point_cloud cloud{{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}}, {{1, 1, 1}, {2, 2, 2}, {3, 3, 3}}};
  const std::vector<std::uint32_t> indices{2, 0};
  const auto part = orbis::cloud::extract(cloud, indices);
  CHECK(part.points == std::vector<orbis::vec3f>{{2, 2, 2}, {0, 0, 0}});
  CHECK(part.colors == std::vector<orbis::rgb8>{{3, 3, 3}, {1, 1, 1}});
  CHECK_FALSE(orbis::cloud::extract({cloud.points, {}}, indices).has_colors());
}

TEST_CASE("a box keeps what lies in it and on its faces") {
  const float inf = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<orbis::vec3f> cloud{{0, 0, 0}, {1, 2, 3}, {0, 0, 3.5F}, {nan, 0, 0}, {inf, 0, 0}, {0, -0.5F, 0}};
  using orbis::cloud::pass_through_inliers;
  CHECK(pass_through_inliers(cloud, {.low = {0, 0, 0}, .high = {1, 2, 3}}) == std::vector<std::uint32_t>{0, 1});
  CHECK(pass_through_inliers(cloud) == std::vector<std::uint32_t>{0, 1, 2, 5});
  CHECK(pass_through_inliers(std::vector<orbis::vec3f>{}).empty());
}

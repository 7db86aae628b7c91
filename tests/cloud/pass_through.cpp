// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/cloud/pass_through.hpp>

#include "support/catch.hpp"

TEST_CASE("a box keeps what lies in it and on its faces") {
  const float inf = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<orbis::vec3f> cloud{{0, 0, 0}, {1, 2, 3}, {0, 0, 3.5F}, {nan, 0, 0}, {inf, 0, 0}, {0, -0.5F, 0}};
  using orbis::cloud::pass_through_inliers;
  CHECK(pass_through_inliers(cloud, {.low = {0, 0, 0}, .high = {1, 2, 3}}) == std::vector<std::uint32_t>{0, 1});
  CHECK(pass_through_inliers(cloud) == std::vector<std::uint32_t>{0, 1, 2, 5});
  CHECK(pass_through_inliers(std::vector<orbis::vec3f>{}).empty());
}

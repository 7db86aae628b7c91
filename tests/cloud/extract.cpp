// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
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

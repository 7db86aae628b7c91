// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/core/point_cloud.hpp>

#include "support/catch.hpp"

TEST_CASE("a cloud has as many points as were put in and colours only if given") {
  orbis::point_cloud cloud;
  CHECK(cloud.empty());
  cloud.points = {{1, 2, 3}, {4, 5, 6}};
  CHECK(cloud.size() == 2);
  CHECK(!cloud.empty());
  CHECK(!cloud.has_colors());
  cloud.colors.resize(2);
  CHECK(cloud.has_colors());
  static_assert(sizeof(cloud.points[0]) == 3 * sizeof(float));
}

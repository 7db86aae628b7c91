// SPDX-License-Identifier: BSD-3-Clause
#include <vector>

#include <orbis/core/associate.hpp>

#include "support/catch.hpp"

using orbis::index_pair;
using stamps = std::vector<double>;

TEST_CASE("the nearest pair is taken first and every stamp once") {
  // 1.2 is nearest to both 1.0 and 1.3; it goes to 1.3, and 1.0 takes the next best.
  CHECK(orbis::associate(stamps{1.0, 1.3}, stamps{0.7, 1.2}, 0.5) == std::vector<index_pair>{{0, 0}, {1, 1}});
  CHECK(orbis::associate(stamps{1.0, 1.3}, stamps{1.2}, 0.5) == std::vector<index_pair>{{1, 0}});
}

TEST_CASE("stamps further apart than allowed are not paired") {
  CHECK(orbis::associate(stamps{1.0, 2.0}, stamps{1.25, 2.5}, 0.25) == std::vector<index_pair>{{0, 0}});
  CHECK(orbis::associate(stamps{}, stamps{1.0}, 1.0).empty());
  CHECK(orbis::associate(stamps{1.0}, stamps{}, 1.0).empty());
}

TEST_CASE("equal differences go to the earlier stamp") {
  CHECK(orbis::associate(stamps{1.0}, stamps{0.5, 1.5}, 1.0) == std::vector<index_pair>{{0, 0}});
  CHECK(orbis::associate(stamps{0.5, 1.5}, stamps{1.0}, 1.0) == std::vector<index_pair>{{0, 0}});
}

TEST_CASE("many equal stamps do not take quadratic time") {
  const stamps same(200000, 1.0);
  CHECK(orbis::associate(same, same, 0.02).size() <= same.size());
}

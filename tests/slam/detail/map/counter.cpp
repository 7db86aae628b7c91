// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <map>

#include <orbis/core/random.hpp>
#include <orbis/slam/detail/map/counter.hpp>
#include <orbis/slam/ids.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("A counter counts as a map does, in the order of first appearance") {
  random_bits random(5);
  for (const std::uint32_t range : {1U, 10U, 1000U, 0xffffffffU}) {
    slam::detail::counter<slam::landmark_id> counted;
    std::map<std::uint32_t, std::uint32_t> plain;
    std::vector<std::uint32_t> order;
    for (int i = 0; i != 3000; ++i) {
      const auto number = (random.below(range) << (i % 3 == 0 ? 16U : 0U)) | 0U;
      const bool first = ++plain[number] == 1;
      if (first) order.push_back(number);
      REQUIRE(counted.add(number) == first);
    }
    REQUIRE(counted.entries().size() == order.size());
    for (std::size_t i = 0; i != order.size(); ++i)
      REQUIRE(counted.entries()[i] == slam::detail::counter<slam::landmark_id>::entry{order[i], plain[order[i]]});
  }
  CHECK(slam::detail::counter<slam::landmark_id>{}.entries().empty());
}

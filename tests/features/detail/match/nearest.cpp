// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/features/detail/match/nearest.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;
using namespace orbis::features::detail;

TEST_CASE("the nearest by any distance are those of sorting, lower indices first") {
  const auto distance = [](int a, int b) { return static_cast<std::uint32_t>(a > b ? a - b : b - a); };
  random_bits random{1};
  std::vector<int> queries(40), trains(25);
  for (int& q : queries) q = static_cast<int>(random.below(30));
  for (int& t : trains) t = static_cast<int>(random.below(30));
  std::vector<nearest_two> found(queries.size());
  std::vector<std::uint32_t> memory;
  nearest_by(distance, std::span<const int>{queries}, std::span<const int>{trains}, std::span{found}, {}, memory);
  for (std::size_t q = 0; q != queries.size(); ++q) {
    std::vector<std::uint32_t> order(trains.size());
    std::iota(order.begin(), order.end(), 0U);
    const auto to = [&](std::uint32_t t) { return distance(queries[q], trains[t]); };
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return to(a) < to(b); });
    CHECK(found[q] == nearest_two{order[0], to(order[0]), to(order[1])});
  }
}

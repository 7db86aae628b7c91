// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/features/detail/match/nearest.hpp>

#include "features/k_nearest_by.hpp"
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
  for (const std::size_t k : {1U, 2U, 5U, 25U, 40U}) {
    std::vector<neighbor> expected;
    for (const int q : queries) {
      std::vector<neighbor> row;
      for (std::uint32_t t = 0; t != trains.size(); ++t) row.push_back({t, distance(q, trains[t])});
      std::stable_sort(row.begin(), row.end(),
                       [](const neighbor& a, const neighbor& b) { return a.distance < b.distance; });
      row.resize(k);
      expected.insert(expected.end(), row.begin(), row.end());
    }
    std::vector<neighbor> found(queries.size() * k, {9, 9});
    test::k_nearest_by(distance, std::span<const int>{queries}, std::span<const int>{trains}, k, std::span{found});
    CHECK(found == expected);
    if (k != 2) continue;
    std::vector<nearest_two> two(queries.size());
    std::vector<std::uint32_t> memory;
    nearest_by(distance, std::span<const int>{queries}, std::span<const int>{trains}, std::span{two}, {}, memory);
    for (std::size_t q = 0; q != queries.size(); ++q)
      CHECK(two[q] == nearest_two{found[2 * q].index, found[2 * q].distance, found[2 * q + 1].distance});
  }
}

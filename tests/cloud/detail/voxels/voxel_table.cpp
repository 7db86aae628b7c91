// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include <orbis/cloud/detail/voxels/voxel_table.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

TEST_CASE("a table of voxels keeps the rows in the order in which they came") {
  struct count {
    std::uint32_t n = 0;
  };
  orbis::cloud::detail::voxel_table<count> table;
  orbis::random_bits random{1};
  for (const std::size_t expected : {100U, 5'000U, 0U}) {  // a table that was cleared is as a new one
    std::map<orbis::cloud::detail::voxel_key, std::size_t> row_of;
    std::vector<std::uint32_t> counts;
    for (std::uint32_t i = 0; i != 5'000; ++i) {
      const orbis::cloud::detail::voxel_key key{
          static_cast<std::int32_t>(random.below(10)) - 5,
          static_cast<std::int32_t>(random.below(10)) * 200'000'000 - 1'000'000'000,
          static_cast<std::int32_t>(random.below(10))};
      const auto [at, is_new] = row_of.try_emplace(key, row_of.size());
      if (is_new) counts.push_back(0);
      ++counts[at->second];
      auto& row = table.at(key, i);
      REQUIRE(&row == &table.rows()[at->second]);
      REQUIRE(row.key == key);
      REQUIRE((row.first == i) == is_new);
      REQUIRE(++row.record.n == counts[at->second]);
    }
    REQUIRE(table.rows().size() == row_of.size());
    table.clear(expected);
    REQUIRE(table.rows().empty());
  }
}

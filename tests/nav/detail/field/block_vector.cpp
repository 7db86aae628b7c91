// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/nav/detail/field/block_vector.hpp>

#include "support/catch.hpp"

using orbis::nav::detail::block_vector;

TEST_CASE("A vector in blocks has the values of an array, and what is added moves no other") {
  orbis::random_bits random{1};
  block_vector<int> blocks;
  std::vector<int> expected;
  CHECK(blocks.empty());
  for (int i = 0; i != 20'000; ++i) {
    const bool grows = random.below(100) < (i / 1000 % 2 == 0 ? 60U : 40U);
    if (grows || expected.empty()) {
      const int* const first = expected.empty() ? nullptr : &blocks[0];
      const int* const last = expected.empty() ? nullptr : &blocks[expected.size() - 1];
      blocks.emplace_back() = i;
      if (first != nullptr) REQUIRE((first == &blocks[0] && last == &blocks[expected.size() - 1]));
      expected.push_back(i);
    } else {
      blocks.pop_back();
      expected.pop_back();
    }
    REQUIRE(blocks.size() == expected.size());
    if (i % 100 != 0) continue;
    block_vector<int> copy = blocks;
    copy.emplace_back() = -1;
    for (std::size_t j = 0; j != expected.size(); ++j) REQUIRE((blocks[j] == expected[j] && copy[j] == expected[j]));
    CHECK(copy[expected.size()] == -1);
    CHECK(blocks.memory_bytes() >= expected.size() * sizeof(int));
    CHECK(blocks.memory_bytes() < 3 * (expected.size() + 32) * sizeof(int) + 1000);
  }
}

// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <orbis/cloud/detail/knn/neighbor_rows.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

TEST_CASE("ranks sort by distance, then by index, with every instruction set") {
  using orbis::simd::level;
  orbis::random_bits random{1};
  for (const level l : {level::portable, level::avx2, level::avx512}) {
    const orbis::simd::level_limit limit{l};
    orbis::cloud::detail::rank_sorter sorter;
    for (int round = 0; round != 600; ++round) {
      const std::size_t count = random.below(round % 50 == 0 ? 1000 : 70);
      const int kind = round % 5;
      std::vector<std::pair<float, std::uint32_t>> expected;
      sorter.clear();
      for (std::size_t i = 0; i != count; ++i) {
        auto d = static_cast<float>(random.uniform());
        if (kind == 1) d = static_cast<float>(random.below(3));
        if (kind == 2) d = 0;
        if (kind == 3 && random.below(4) == 0) d = std::numeric_limits<float>::infinity();
        if (kind == 4 && random.below(4) == 0) d = std::numeric_limits<float>::max();
        const auto index = static_cast<std::uint32_t>(random() >> 32U);
        sorter.add(index, d);
        expected.emplace_back(d, index);
      }
      CHECK(sorter.size() == count);
      std::sort(expected.begin(), expected.end());
      std::vector<std::pair<float, std::uint32_t>> sorted;
      sorter.for_each([&](std::size_t rank, std::uint32_t index, float d) {
        sorted.emplace_back(d, index);
        return rank + 1 == sorted.size();
      });
      CHECK(sorted == expected);
    }
    sorter.clear();
    for (std::uint32_t i = 0; i != 9; ++i) sorter.add(i, static_cast<float>(9 - i));
    std::size_t seen = 0;
    sorter.for_each([&](std::size_t rank, std::uint32_t index, float) {
      CHECK(index == 8 - rank);
      return ++seen != 4;  // enough
    });
    CHECK(seen == 4);
  }
}

TEST_CASE("nothing is sorted as well") {
  orbis::cloud::detail::rank_sorter sorter;
  bool called = false;
  sorter.for_each([&](std::size_t, std::uint32_t, float) { return called = true; });
  CHECK_FALSE(called);
}

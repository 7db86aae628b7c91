// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/cloud/detail/knn/rank_bracket.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

using orbis::cloud::detail::bracket_rank;
using orbis::cloud::detail::rank_bracket;

TEST_CASE("a bracket holds the value of a rank and at most sixteen values, or equal ones") {
  orbis::random_bits random{7};
  for (int round = 0; round != 300; ++round) {
    std::vector<float> values(1 + random.below(400));
    const bool few_values = round % 3 == 0;
    for (float& v : values)
      v = few_values ? static_cast<float>(random.below(4)) : static_cast<float>(random.uniform(0.0, 2.0));
    std::sort(values.begin(), values.end());
    const auto count_within = [&](float at) {
      return static_cast<std::size_t>(std::upper_bound(values.begin(), values.end(), at) - values.begin());
    };
    const auto count_three = [&](const std::array<float, 3>& at) {
      return std::array<std::size_t, 3>{count_within(at[0]), count_within(at[1]), count_within(at[2])};
    };
    const std::size_t wanted = 1 + random.below(static_cast<std::uint32_t>(values.size()));
    const rank_bracket found = bracket_rank(values.back(), values.size(), wanted, count_within, count_three);
    const float ranked = values[wanted - 1];
    CHECK(ranked > found.low);
    CHECK(ranked <= found.high);
    CHECK(found.at_low == (found.low < 0 ? 0 : count_within(found.low)));
    CHECK(found.at_high == count_within(found.high));
    const bool equal = values[found.at_low] == values[found.at_high - 1];
    CHECK((equal || found.at_high - found.at_low <= 16));
  }
}

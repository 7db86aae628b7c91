// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <vector>

#include <orbis/cloud/detail/select/surroundings.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

using orbis::cloud::detail::sparse_values;

TEST_CASE("sparse values are those that were added first, under any policy") {
  for (const std::size_t n : {0U, 1U, 63U, 64U, 65U, 5000U}) {
    orbis::random_bits random{n};
    std::vector<float> expected(n, NAN);
    sparse_values alone, together;
    for (int round = 0; round != 4; ++round) {
      std::vector<char> wanted(n);
      for (char& w : wanted) w = random.below(round == 3 ? 1 : 9) == 0 ? 1 : 0;  // all of them in the end
      const auto is_wanted = [&](std::size_t i) { return wanted[i] != 0; };
      const auto value = [&](std::size_t i) { return static_cast<float>(i) + 0.25F * static_cast<float>(round); };
      alone.add(orbis::seq, n, is_wanted, value);
      together.add(orbis::par.with(3), n, is_wanted, value);
      for (std::size_t i = 0; i != n; ++i) {
        if (wanted[i] != 0 && std::isnan(expected[i])) expected[i] = value(i);
        REQUIRE(alone.has(i) == !std::isnan(expected[i]));
        REQUIRE((std::isnan(expected[i]) ? std::isnan(alone.at(i)) : alone.at(i) == expected[i]));
        REQUIRE((std::isnan(expected[i]) ? std::isnan(together.at(i)) : together.at(i) == expected[i]));
      }
    }
    CHECK_FALSE(alone.has(n));
  }
}

// SPDX-License-Identifier: BSD-3-Clause
#include <bit>
#include <cstdint>

#include <orbis/core/bits.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

static_assert(orbis::count_ones(0) == 0 && orbis::count_ones(~std::uint64_t{0}) == 64);

TEST_CASE("Ones are counted as the standard library counts them") {
  orbis::random_bits random(1);
  for (int i = 0; i < 1000; ++i) {
    const std::uint64_t x = random() & random();
    CHECK(orbis::count_ones(x) == static_cast<std::uint32_t>(std::popcount(x)));
  }
}

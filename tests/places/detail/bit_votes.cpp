// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/places/detail/bit_votes.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("votes are counted bit by bit, beyond where a byte runs over, and ties go as told") {
  random_bits random{1};
  const auto count = GENERATE(0, 1, 2, 255, 256, 1000);
  std::vector<int> ones(128);
  places::detail::bit_votes<128> votes, first_half;
  for (int i = 0; i != count; ++i) {
    const bit_words<128> d{random() & random(), random() | random()};
    (i % 2 == 0 ? first_half : votes).add(d);
    for (std::size_t b = 0; b != 128; ++b) ones[b] += static_cast<int>((d[b / 64] >> (b % 64)) & 1U);
  }
  votes.add(first_half);
  CHECK(votes.total() == static_cast<std::uint64_t>(count));
  const bit_words<128> tie{0x5555555555555555ULL, 0x0f0f0f0f0f0f0f0fULL};
  const auto majority = votes.majority(tie);
  for (std::size_t b = 0; b != 128; ++b) {
    const bool expected = 2 * ones[b] == count ? ((tie[b / 64] >> (b % 64)) & 1U) != 0 : 2 * ones[b] > count;
    CHECK((((majority[b / 64] >> (b % 64)) & 1U) != 0) == expected);
  }
}

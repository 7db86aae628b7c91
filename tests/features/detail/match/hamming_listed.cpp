// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/detail/match/hamming_listed.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;
using namespace orbis::features::detail;

TEMPLATE_TEST_CASE("distances to listed descriptors are those of the definition, at every level", "",
                   binary_descriptor<64>, binary_descriptor<256>, binary_descriptor<512>) {
  random_bits random{1};
  std::vector<TestType> trains(50);
  for (auto& t : trains)
    for (auto& word : t.words) word = random();
  trains[7].words.fill(0);
  trains[8].words.fill(~std::uint64_t{0});
  for (const auto level : simd::available_levels())
    for (const std::size_t count : {0U, 1U, 33U}) {
      const simd::level_limit limit{level};
      std::vector<std::uint32_t> indices(count), distances(count, 12345);
      for (auto& i : indices) i = random.below(50) % 50;
      if (count > 0) indices[0] = 8;
      hamming_listed(trains[7], std::span<const TestType>{trains}, indices, distances);
      for (std::size_t i = 0; i != count; ++i) {
        std::uint32_t expected = 0;
        for (std::size_t b = 0; b != TestType::bits; ++b) expected += trains[7].bit(b) != trains[indices[i]].bit(b);
        CHECK(distances[i] == expected);
      }
    }
}

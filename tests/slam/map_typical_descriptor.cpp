// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/features/descriptor.hpp>
#include <orbis/slam/map-inl.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

/// A descriptor with the lowest `count` bits of its first word set.
features::binary_descriptor<256> with_bits(unsigned count) {
  features::binary_descriptor<256> d{};
  d.words[0] = (std::uint64_t{1} << count) - 1;
  return d;
}

std::size_t typical(const std::vector<unsigned>& bits) {
  return slam::detail::most_typical(bits.size(), [&](std::size_t i) { return with_bits(bits[i]); });
}

}  // namespace

TEST_CASE("The most typical descriptor has the least median distance to the others") {
  CHECK(typical({0, 10, 11, 12, 40}) == 2);
  CHECK(typical({40, 0, 11, 12, 10}) == 2);
  CHECK(typical({5, 5, 5}) == 0);  // the first of equals
}

TEST_CASE("Of one or two descriptors the last one is taken") {
  CHECK(typical({3}) == 0);
  CHECK(typical({3, 9}) == 1);
}

TEST_CASE("Of many descriptors evenly spread ones are compared, with the first and the last") {
  std::size_t asked = 0, least = 100, most = 0;
  const std::size_t found = slam::detail::most_typical(100, [&](std::size_t i) {
    ++asked;
    least = std::min(least, i);
    most = std::max(most, i);
    return with_bits(static_cast<unsigned>(i) / 2);
  });
  CHECK(asked <= 16 * 16);
  CHECK(least == 0);
  CHECK(most == 99);
  CHECK((found > 20 && found < 80));
}

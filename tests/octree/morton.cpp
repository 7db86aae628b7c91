// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/core/random.hpp>
#include <orbis/octree/morton.hpp>

#include "support/catch.hpp"

using namespace orbis::octree;

TEST_CASE("A Morton code has the bits of x y and z in turn and leads back to its voxel") {
  orbis::random_bits random{17};
  for (int run = 0; run != 20000; ++run) {
    const auto any = [&] { return random.below(1U << (1 + random.below(21))); };
    const voxel_key key{any(), any(), any()};
    std::uint64_t code = 0;
    for (unsigned bit = 0; bit != 21; ++bit)
      code |= std::uint64_t{key.x >> bit & 1U} << (3 * bit) | std::uint64_t{key.y >> bit & 1U} << (3 * bit + 1) |
              std::uint64_t{key.z >> bit & 1U} << (3 * bit + 2);
    REQUIRE(morton_code(key) == code);
    REQUIRE(morton_key(code) == key);
  }
  const voxel_key last{(1U << 21U) - 1, (1U << 21U) - 1, (1U << 21U) - 1};
  CHECK(morton_code(last) == (std::uint64_t{1} << 63U) - 1);
  CHECK(morton_key(morton_code(last)) == last);
}

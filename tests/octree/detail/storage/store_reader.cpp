// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <optional>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/storage/store_reader.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

TEST_CASE("A reader finds what the store finds, wherever it looked before") {
  random_bits random{403};
  brick_store<float> store;
  for (int i = 0; i != 300; ++i) {
    const voxel_key k{1000 + random.below(100), 1000 + random.below(100), 1000 + random.below(100)};
    if (!store.value(k)) store.set_node(k, 0, static_cast<float>(random.below(9)) - 4.0F);
  }
  store.set_node({2048, 1024, 1024}, 6, 0.25F);  // a leaf of 64 voxels along each edge
  store_reader<float> reader{store};
  voxel_key k{1000, 1000, 1000};
  for (int i = 0; i != 20000; ++i) {
    const auto near = [&](std::uint32_t c) { return c + random.below(5) - 2; };
    k = {near(k.x), near(k.y), near(k.z)};
    if (random.below(50) == 0) k = {990 + random.below(120), 990 + random.below(120), 990 + random.below(120)};
    if (random.below(100) == 0) k = {2030 + random.below(100), 1020 + random.below(80), 1020 + random.below(80)};
    const std::optional<float> value = store.value(k);
    REQUIRE(reader.value(k) == value);
    if (value) REQUIRE_FALSE(reader.is_below(*value));
  }
}

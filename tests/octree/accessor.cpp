// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <limits>
#include <optional>

#include <orbis/octree/accessor.hpp>

#include "octree/support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

namespace {

/// Nodes of all sizes at random places, the largest first, so that there are voxels, bricks and large leaves side by
/// side.
[[nodiscard]] brick_store<float> random_store(random_bits& random, std::uint32_t cells) {
  brick_store<float> store;
  for (int i = 0; i != 420; ++i) {
    const int level = 6 - i / 60;
    const voxel_key k = node_key({random.below(cells), random.below(cells), random.below(cells)}, level);
    bool empty = true;  // a node may only be set where nothing is known
    const std::uint32_t size = node_cells(level);
    for (std::uint32_t x = 0; x != size && empty; ++x)
      for (std::uint32_t y = 0; y != size && empty; ++y)
        for (std::uint32_t z = 0; z != size && empty; ++z) empty = !store.value(voxel_key{k.x + x, k.y + y, k.z + z});
    if (empty) store.set_node(k, level, static_cast<float>(random.below(40)) * 0.25F - 2.0F);
  }
  return store;
}

}  // namespace

TEST_CASE("An accessor reads what the store holds, wherever it looked before") {
  random_bits random{61};
  for (int round = 0; round != 8; ++round) {
    const brick_store<float> store = random_store(random, round < 4 ? 32 : 128);
    store_reader<float> reader{store};
    voxel_key k{};
    std::size_t known = 0;
    for (int i = 0; i != 40000; ++i) {
      if (i % 50 == 0) k = {random.below(160), random.below(160), random.below(160)};
      std::uint32_t* const axis[] = {&k.x, &k.y, &k.z};
      std::uint32_t& at = *axis[random.below(3)];
      at = (at + random.below(9) + 156) % 160;
      const std::optional<float> value = reader.value(k);
      REQUIRE(value == store.value(k));
      known += value ? 1 : 0;
    }
    CHECK(known > 1000);
  }
}

TEST_CASE("An accessor answers as the map and as OctoMap do") {
  random_bits random{62};
  occupancy_octree<> map{0.05};
  octomap::OcTree theirs{0.05};
  const auto scan = test::shell_scan(random, 3000, vec3f{0.1F, 0.0F, 0.0F});
  map.integrate(scan, vec3f{0.1F, 0.0F, 0.0F});
  test::insert(theirs, scan, {0.1F, 0.0F, 0.0F}, {});

  auto near = map.accessor();
  int seen[3] = {};
  for (int line = 0; line != 300; ++line) {
    const vec3f a = test::random_points(random, 1, 2.0)[0], b = test::random_points(random, 1, 2.0)[0];
    for (int i = 0; i != 60; ++i) {
      const vec3f p = a + (b - a) * (static_cast<float>(i) / 60.0F);
      REQUIRE(near.value(p) == map.value(p));
      REQUIRE(near.log_odds(p) == map.log_odds(p));
      REQUIRE(near.probability(p) == map.probability(p));
      REQUIRE(near.state(p) == map.state(p));
      ++seen[static_cast<int>(near.state(p))];
      const auto* const node = theirs.search(test::to_octomap(p));
      REQUIRE((node != nullptr) == near.log_odds(p).has_value());
      if (node != nullptr) REQUIRE(node->getLogOdds() == *near.log_odds(p));
      const auto key = map.grid().key(p);
      REQUIRE(key);
      REQUIRE(near.state(*key) == map.state(p));
    }
  }
  for (const int n : seen) CHECK(n > 100);
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  CHECK(near.state(vec3f{nan, 0.0F, 0.0F}) == occupancy::unknown);
  CHECK(!near.log_odds(vec3f{1e6F, 0.0F, 0.0F}));
}

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

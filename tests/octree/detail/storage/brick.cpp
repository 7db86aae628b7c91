// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/storage/brick.hpp>
#include <orbis/octree/detail/storage/palette_kernels.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

TEST_CASE("A node set at any level is known inside and unknown outside") {
  for (int level = 0; level < default_tree_depth; ++level) {
    brick_store<float> store;
    const std::uint32_t cells = node_cells(level);
    const voxel_key low{32768 - cells, 32768, 32768};
    store.set_node(low, level, 0.25F);
    for (const std::uint32_t d : {0U, cells / 2, cells - 1})
      CHECK(store.value({low.x + d, low.y + cells - 1 - d, low.z + d}) == 0.25F);
    CHECK_FALSE(store.value({low.x + cells, low.y, low.z}));
    CHECK_FALSE(store.value({low.x, low.y - 1, low.z}));
    CHECK(store.memory_bytes() < 40000);
  }
}

TEST_CASE("Making a brick inside a large leaf keeps the value of everything else in it") {
  brick_store<float> store;
  store.set_node({32768, 32768, 32768}, 8, 0.5F);  // 256 voxels wide
  const voxel_key inside{32768 + 77, 32768 + 200, 32768 + 3};
  brick<float>& b = store.make(inside);
  CHECK(b.uniform == 0xff);
  const std::uint32_t octant = place_in_brick(inside) >> 6U;
  octree::detail::block<float> voxels;
  store.read_octant(b, octant, voxels);
  voxels.value[place_in_brick(inside) & 63U] = -1.0F;
  store.write_octant(b, octant, voxels);
  random_bits random{2};
  for (int i = 0; i != 5000; ++i) {
    const voxel_key k{32768 + random.below(256), 32768 + random.below(256), 32768 + random.below(256)};
    REQUIRE(store.value(k) == (k == inside ? -1.0F : 0.5F));
  }
  CHECK(store.value(inside) == -1.0F);
  CHECK_FALSE(store.value({32767, 32768, 32768}));
  CHECK_FALSE(store.value({32768 + 256, 32768, 32768}));
}

namespace {

/// The same voxels in a plain map.
struct reference {
  std::map<std::array<std::uint32_t, 3>, float> voxels;

  void check(const brick_store<float>& store, std::uint32_t base, std::uint32_t width) const {
    for (std::uint32_t z = 0; z != width; ++z)
      for (std::uint32_t y = 0; y != width; ++y)
        for (std::uint32_t x = 0; x != width; ++x) {
          const auto it = voxels.find({base + x, base + y, base + z});
          const auto got = store.value({base + x, base + y, base + z});
          REQUIRE(got.has_value() == (it != voxels.end()));
          if (got) {
            REQUIRE(*got == it->second);
          }
        }
  }
};

}  // namespace

TEST_CASE("Octants of any number of values come back as they were written") {
  random_bits random{8};
  for (const std::uint32_t kinds : {1U, 2U, 3U, 5U, 9U, 17U, 33U, 64U}) {
    brick_store<float> store;
    reference expected;
    for (int round = 0; round != 60; ++round) {
      const voxel_key at{1024 + 4 * random.below(12), 1024 + 4 * random.below(12), 1024 + 4 * random.below(12)};
      brick<float>& b = store.make(at);
      const std::uint32_t octant = place_in_brick(at) >> 6U;
      octree::detail::block<float> voxels, back;
      voxels.known = random.below(3) == 0 ? ~std::uint64_t{0} : random() & random();
      std::optional<float> largest;
      for (std::uint32_t i = 0; i != 64; ++i) {
        const voxel_key in = voxel_in_brick(i);
        const std::array<std::uint32_t, 3> name{at.x + in.x, at.y + in.y, at.z + in.z};
        expected.voxels.erase(name);
        if ((voxels.known >> i & 1U) == 0) continue;
        voxels.value[i] = static_cast<float>(random.below(kinds)) * 0.37F - 2.0F;
        expected.voxels[name] = voxels.value[i];
        largest = std::max(largest.value_or(voxels.value[i]), voxels.value[i]);
      }
      store.write_octant(b, octant, voxels);
      store.read_octant(b, octant, back);
      REQUIRE(back.known == voxels.known);
      REQUIRE(back.value == voxels.value);
      REQUIRE(store.known(b, octant) == voxels.known);
      if (largest) {
        REQUIRE(b.value[octant] == *largest);
      }
      const std::uint64_t below = store.voxels_where(b, octant, [](float v) { return v < -1.0F; });
      for (std::uint32_t i = 0; i != 64; ++i)
        REQUIRE((below >> i & 1U) == std::uint64_t{(voxels.known >> i & 1U) != 0 && voxels.value[i] < -1.0F});
    }
    expected.check(store, 1020, 60);

    // What changes in a copy does not change in the original, nor the other way round.
    const brick_store<float> before = store;
    std::size_t told = 0;
    store.transform([](float v) { return v < -1.0F ? std::nullopt : std::optional{v + 1.0F}; },
                    [&](std::uint64_t, std::uint32_t, std::uint64_t mask) {
                      told += static_cast<std::size_t>(std::popcount(mask));
                    });
    CHECK(told == expected.voxels.size());
    expected.check(before, 1020, 60);
    reference changed;
    for (const auto& [name, v] : expected.voxels)
      if (!(v < -1.0F)) changed.voxels[name] = v + 1.0F;
    changed.check(store, 1020, 60);
  }
}

TEST_CASE("Records of octants that become uniform are used again") {
  brick_store<float> store;
  brick<float>& b = store.make({0, 0, 0});
  octree::detail::block<float> mixed, uniform;
  mixed.known = uniform.known = ~std::uint64_t{0};
  uniform.value.fill(1.0F);
  for (std::size_t i = 0; i != 64; ++i) mixed.value[i] = static_cast<float>(i % 7);
  for (int i = 0; i != 1000; ++i) {
    store.write_octant(b, 3, mixed);
    CHECK(b.dense == 8);
    store.write_octant(b, 3, uniform);
    CHECK(b.uniform == 8);
  }
  CHECK(store.memory_bytes() < 30000);
}

TEST_CASE("Erased bricks are gone and their room is used again") {
  brick_store<float> store;
  for (int round = 0; round != 50; ++round) {
    std::vector<std::uint64_t> names;
    for (std::uint32_t i = 0; i != 100; ++i) {
      const voxel_key k{8 * (i % 10) + 8000U * static_cast<std::uint32_t>(round), 8 * (i / 10), 64};
      store.set_node(k, 0, static_cast<float>(i));
      if (i != 7) names.push_back(node_name(k, brick_level));
    }
    store.erase_bricks(names);
    CHECK(store.brick_count() == static_cast<std::size_t>(round + 1));
    CHECK(store.value({8 * 7 + 8000U * static_cast<std::uint32_t>(round), 0, 64}) == 7.0F);
    CHECK_FALSE(store.value({8 * 8 + 8000U * static_cast<std::uint32_t>(round), 0, 64}));
  }
  CHECK(store.memory_bytes() < 120000);
}

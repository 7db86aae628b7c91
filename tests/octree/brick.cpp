// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/core/random.hpp>
#include <orbis/octree/brick.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;

TEST_CASE("Places in a brick are a bijection and children are neighbours") {
  for (std::uint32_t place = 0; place != 512; ++place) {
    const voxel_key k = voxel_in_brick(place);
    REQUIRE((k.x < 8 && k.y < 8 && k.z < 8));
    REQUIRE(place_in_brick(k) == place);
    REQUIRE(child_key(voxel_in_brick(place & ~7U), place & 7U, 1) == k);
  }
}

TEST_CASE("A node's name gives back its lowest voxel") {
  random_bits random{5};
  for (int i = 0; i != 1000; ++i) {
    const voxel_key k{random.below(65536), random.below(65536), random.below(65536)};
    for (int depth = 1; depth <= tree_depth; ++depth) {
      const std::uint32_t inside = node_cells(depth) - 1;
      REQUIRE(named_key(node_name(k, depth)) == voxel_key{k.x & ~inside, k.y & ~inside, k.z & ~inside});
    }
  }
}

TEST_CASE("A node set at any depth is known inside and unknown outside") {
  for (int depth = 1; depth <= tree_depth; ++depth) {
    brick_store<float> store;
    const std::uint32_t cells = node_cells(depth);
    const voxel_key low{32768 - cells, 32768, 32768};
    store.set_node(low, depth, 0.25F);
    for (const std::uint32_t d : {0U, cells / 2, cells - 1}) {
      const float* const v = store.value({low.x + d, low.y + cells - 1 - d, low.z + d});
      REQUIRE(v != nullptr);
      CHECK(*v == 0.25F);
    }
    CHECK(store.value({low.x + cells, low.y, low.z}) == nullptr);
    CHECK(store.value({low.x, low.y - 1, low.z}) == nullptr);
    CHECK(store.memory_bytes() < 40000);
  }
}

TEST_CASE("Making a brick inside a large leaf keeps the value of everything else in it") {
  brick_store<float> store;
  store.set_node({32768, 32768, 32768}, 8, 0.5F);  // 256 voxels wide
  const voxel_key inside{32768 + 77, 32768 + 200, 32768 + 3};
  brick<float>& b = store.make(inside);
  CHECK(b.uniform == 0xff);
  store.make_block(b, place_in_brick(inside) >> 6U).value[place_in_brick(inside) & 63U] = -1.0F;
  random_bits random{2};
  for (int i = 0; i != 5000; ++i) {
    const voxel_key k{32768 + random.below(256), 32768 + random.below(256), 32768 + random.below(256)};
    REQUIRE(store.value(k) != nullptr);
    REQUIRE(*store.value(k) == (k == inside ? -1.0F : 0.5F));
  }
  CHECK(*store.value(inside) == -1.0F);
  CHECK(store.value({32767, 32768, 32768}) == nullptr);
  CHECK(store.value({32768 + 256, 32768, 32768}) == nullptr);
}

TEST_CASE("Blocks of octants that become uniform are used again") {
  brick_store<float> store;
  brick<float>& b = store.make({0, 0, 0});
  for (int i = 0; i != 1000; ++i) {
    block<float>& voxels = store.make_block(b, 3);
    CHECK(voxels.known == (i == 0 ? 0 : ~std::uint64_t{0}));
    voxels.value.fill(1.0F);
    voxels.known = ~std::uint64_t{0};
    CHECK(voxels.is_uniform());
    store.make_uniform(b, 3, 1.0F);
  }
  CHECK(store.memory_bytes() < 20000);
}

// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/storage/node_name.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

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
  const std::uint32_t cells = 1U << max_tree_depth;
  for (int i = 0; i != 1000; ++i) {
    const voxel_key k{random.below(cells), random.below(cells), random.below(cells)};
    for (int level = octant_level; level <= max_tree_depth; ++level) {
      REQUIRE(named_key(node_name(k, level)) == node_key(k, level));
      REQUIRE(named_level(node_name(k, level)) == level);
    }
    REQUIRE(morton_order(k) >> 6U == morton_order(node_key(k, chunk_level)) >> 6U);
    REQUIRE((morton_order(k) & 63U) == place_in_chunk(k));
    REQUIRE(node_key(k, brick_level) == [&] {
      const voxel_key c = node_key(k, chunk_level), b = brick_in_chunk(place_in_chunk(k));
      return voxel_key{c.x + b.x, c.y + b.y, c.z + b.z};
    }());
  }
}

// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <map>
#include <utility>

#include <orbis/octree/detail/storage/large_leaves.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

TEST_CASE("A large leaf is found from every voxel in it, until it is erased") {
  large_leaves<float> leaves;
  CHECK(leaves.empty());
  const voxel_key small{64, 128, 192}, large{4096, 0, 0};
  leaves.add(node_name(small, 4), 0.5F);
  leaves.add(node_name(large, 9), -1.0F);
  REQUIRE(leaves.size() == 2);
  for (const std::uint32_t d : {0U, 7U, 15U}) {
    REQUIRE(leaves.find({64 + d, 128 + 15 - d, 192 + d}) != nullptr);
    CHECK(leaves.find({64 + d, 128 + 15 - d, 192 + d})->value == 0.5F);
  }
  CHECK(leaves.find({80, 128, 192}) == nullptr);
  CHECK(leaves.find({63, 128, 192}) == nullptr);
  REQUIRE(leaves.find({4096 + 511, 511, 511}) != nullptr);
  CHECK(named_level(leaves.find({4096 + 511, 511, 511})->name) == 9);

  const large_leaves<float> copy = leaves;
  leaves.set_value(1, 2.0F);
  leaves.erase(node_name(small, 4));
  leaves.erase(node_name(small, 4));  // nothing happens
  CHECK(leaves.size() == 1);
  CHECK(leaves.find(small) == nullptr);
  CHECK(leaves.find(large)->value == 2.0F);
  CHECK(copy.find(small)->value == 0.5F);
  CHECK(copy.find(large)->value == -1.0F);

  large_leaves<float> moved = std::move(leaves);
  CHECK(moved.find(large)->value == 2.0F);
  moved.erase(node_name(large, 9));
  CHECK(moved.empty());
}

// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <vector>

#include <orbis/octree/detail/storage/palette_kernels.hpp>
#include <orbis/octree/detail/storage/tree_parts.hpp>

#include "support/catch.hpp"

using namespace orbis::octree;
using namespace orbis::octree::detail;

TEST_CASE("Equal bricks and leaves merge as far as they go, but not into the root") {
  for (const bool differing : {false, true}) {
    brick_store<float> store;
    // An eighth of a tree of 6 levels in leaves of several sizes, all 1 but perhaps the last voxel.
    for (std::uint32_t i = 1; i != 8; ++i) store.set_node(child_key({}, i, 16), 4, 1.0F);
    for (std::uint32_t i = 0; i != 8; ++i) store.set_node(child_key({}, i, 8), 3, 1.0F);
    if (differing) {
      store.set_node({32, 0, 0}, 4, 2.0F);
      store.set_node({48, 0, 0}, 3, 1.0F);
      store.set_node({63, 63, 63}, 0, 1.0F);
    }
    const auto parts = tree_parts(store, 6);
    REQUIRE(parts.size() == (differing ? 4 : 1));
    CHECK(parts[0].level == 5);
    CHECK(parts[0].order == 0);
    CHECK(parts[0].content == nullptr);
    CHECK(parts[0].value == 1.0F);
    CHECK(std::is_sorted(parts.begin(), parts.end(), [](const auto& a, const auto& b) { return a.order < b.order; }));
    if (!differing) continue;
    CHECK(parts[1].value == 2.0F);
    CHECK(parts[2].level == brick_level);
    CHECK(parts[2].content == nullptr);
    CHECK(parts[3].content != nullptr);
  }
  brick_store<float> whole;
  for (std::uint32_t i = 0; i != 8; ++i) whole.set_node(child_key({}, i, 16), 4, 1.0F);
  CHECK(tree_parts(whole, 5).size() == 8);
  CHECK(tree_parts(whole, 6).size() == 1);
  CHECK(tree_parts(brick_store<float>{}, 6).empty());
}

TEST_CASE("A walk opens and closes nodes around their children in order") {
  struct counter {
    struct node {
      unsigned children = 0;
      std::size_t below = 0;
      void add(unsigned i, std::size_t parts) {
        children |= 1U << i;
        below += parts;
      }
    };
    std::vector<std::uint64_t> seen;
    std::vector<int> closed;
    [[nodiscard]] node open() const { return {}; }
    std::size_t close(int level, const node& n) {
      closed.push_back(level);
      return n.below;
    }
    std::size_t content(const tree_part<float>& part) {
      seen.push_back(part.order);
      return 1;
    }
  };
  brick_store<float> store;
  store.set_node({8, 0, 0}, 3, 1.0F);
  store.set_node({16, 0, 0}, 4, 1.0F);
  store.set_node({56, 56, 56}, 0, 1.0F);
  counter c;
  const auto parts = tree_parts(store, 6);
  CHECK(upper_walk<float, counter>{parts, c}.walk(6) == 3);
  CHECK(c.seen == std::vector<std::uint64_t>{1, 8, 511});
  CHECK(c.closed == std::vector<int>{4, 5, 4, 5, 6});
}

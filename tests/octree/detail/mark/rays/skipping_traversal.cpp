// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstddef>
#include <cstdint>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/mark/rays/skipping_traversal.hpp>
#include <orbis/octree/key.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

TEST_CASE("A node that is left at once is left where steps leave it") {
  random_bits random{5};
  const voxel_grid grid{0.1};
  for (int round = 0; round != 500; ++round) {
    float3 origin, end;
    for (std::size_t i = 0; i != 3; ++i) {
      origin[i] = static_cast<float>(random.uniform(-2.0, 2.0));
      end[i] = round % 7 == 0 && i == 1 ? origin[i] : static_cast<float>(random.uniform(-40.0, 40.0));
    }
    const auto start = ray_traversal::between(grid, *grid.key(origin), origin, end);
    REQUIRE(start);
    ray_traversal by_step = *start;
    skipping_traversal skipping{*start};
    for (int n = 0; n != 30; ++n) {
      if (n % 3 == 0) {
        const std::size_t axis = by_step.axis();
        const double parameter = by_step.next[axis];
        by_step.advance(axis);
        const auto face = skipping.step();
        CHECK(face.axis == axis);
        CHECK(face.parameter == parameter);
      } else {
        const std::uint32_t cells = 1U << random.below(6);
        const auto same_node = [&](const voxel_key& a, const voxel_key& b) {
          return ((a.x ^ b.x) | (a.y ^ b.y) | (a.z ^ b.z)) < cells;
        };
        const voxel_key from = by_step.key();
        std::size_t axis = 0;
        double parameter = 0.0;
        while (same_node(by_step.key(), from)) {
          axis = by_step.axis();
          parameter = by_step.next[axis];
          by_step.advance(axis);
        }
        const auto way = skipping.find_node_exit(cells);
        CHECK(way.face.axis == axis);
        CHECK(way.face.parameter == parameter);
        skipping.take(way);
      }
      REQUIRE(skipping.key() == by_step.key());
    }
  }
}

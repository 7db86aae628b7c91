// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/octree/detail/mark/rays/plane_crossings.hpp>

#include "support/catch.hpp"

using namespace orbis::octree::detail;

TEST_CASE("Each cell of a map has a number of its own, tile by tile") {
  plane_stack stack;
  stack.log2_width = 2;  // 4 x 3 tiles
  stack.low_u = -16;
  stack.low_v = 8;
  std::vector<int> seen(4 * 3 * 64, 0);
  for (std::int32_t v = 8; v != 32; ++v)
    for (std::int32_t u = -16; u != 16; ++u) {
      const std::uint32_t cell = stack.cell(u, v);
      REQUIRE(cell < seen.size());
      ++seen[cell];
      CHECK(cell / 64 == static_cast<std::uint32_t>((v - 8) / 8 * 4 + (u + 16) / 8));
    }
  CHECK(seen == std::vector<int>(seen.size(), 1));
}

TEST_CASE("Queued rays have room for a whole group of lanes") {
  queued_rays rays;
  rays.fit(5);
  CHECK(rays.planes.size() >= 5 + queued_rays::lanes);
  const std::size_t bytes = rays.memory_bytes();
  rays.fit(3);
  CHECK(rays.memory_bytes() == bytes);
  CHECK((rays.u.size() == rays.dv.size() && rays.id.size() == rays.planes.size()));
}

// SPDX-License-Identifier: BSD-3-Clause
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/points/fallback_rays.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

TEST_CASE("Rays that are walked together, near and far ones, cross what they cross one by one") {
  random_bits random{221};
  octree::detail::fallback_rays rays;
  const voxel_grid grid{0.05};
  const float3 origin{0.1F, -0.2F, 0.3F};
  const voxel_key from = *grid.key(origin);
  for (const std::size_t count : {1U, 40U, 1000U}) {
    scan_masks together, alone;
    for (std::size_t i = 0; i != count; ++i) {
      const double half = i % 100 == 7 ? 300.0 : 2.0;
      float3 end;
      for (float& c : end) c = static_cast<float>(random.uniform(-half, half));
      rays.add(end);
      alone.mark_ray(grid, origin, from, end, *grid.key(end));
    }
    REQUIRE(rays.size() == count);
    rays.flush(grid, origin, from, together);
    CHECK(rays.size() == 0);
    for (const auto& [a, b] : {std::pair{&together, &alone}, std::pair{&alone, &together}})
      for (const scan_brick& s : a->bricks()) {
        const scan_brick* const other = b->find(s.name);
        REQUIRE(other != nullptr);
        REQUIRE(other->free == s.free);
      }
  }
}

// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstdint>

#include <orbis/octree/detail/mark/rays/scan_origin.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

TEST_CASE("An origin inside a voxel has no first steps, one on an edge has") {
  const voxel_grid grid{0.1};
  const float3 inside{0.05F, 0.03F, 0.07F};
  const scan_origin middle{grid, inside, *grid.key(inside)};
  CHECK_FALSE(middle.on_edge);
  CHECK(middle.first[0][0] > 0.49);
  CHECK(middle.first[0][0] < 0.51);
  CHECK(middle.first[1][1] > 0.29);
  CHECK(middle.first[1][1] < 0.31);

  const float3 corner{0.0F, 0.0F, 0.05F};  // on the lower faces along x and y
  const scan_origin edge{grid, corner, *grid.key(corner)};
  REQUIRE(edge.on_edge);
  CHECK(edge.skipped[1][0] == 1);
  CHECK(edge.skipped[1][1] == 1);
  CHECK(edge.skipped[0][0] == 0);
  // A ray towards -x and -y leaves through both faces at once: last axis first, as a traversal does.
  const std::array<std::size_t, 3> down{1, 1, 0};
  const std::uint32_t passed = first_steps(edge, {-0.5F, -0.5F, 0.06F}, down);
  REQUIRE(passed != 0);
  CHECK((passed >> 13U & 1U) == 1);  // the origin's own voxel
  CHECK((passed >> 10U & 1U) == 1);  // the one below along y
  CHECK((passed >> 12U & 1U) == 0);  // not the one below along x
}

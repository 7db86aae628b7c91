// SPDX-License-Identifier: BSD-3-Clause
#include <limits>
#include <vector>

#include <orbis/octree/integration.hpp>
#include <orbis/octree/occupancy_octree-inl.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;

TEST_CASE("a summary counts points of rays, and voxels of discretized scans") {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<vec3f> points{{1.01F, 0.01F, 0.01F}, {1.03F, 0.03F, 0.03F}, {0.0F, 1.55F, 0.01F},
                                  {0.01F, 9.0F, 0.01F},  {0.01F, 9.01F, 0.01F}, {nan, 0.0F, 0.0F}};
  for (const ray_mode mode : {ray_mode::every_ray, ray_mode::discretized}) {
    occupancy_octree<> map{0.1};
    const integration_summary s = map.integrate(points, vec3f::Zero(), {.max_range = 2.0, .mode = mode});
    const bool all = mode == ray_mode::every_ray;
    CHECK(s.used == (all ? 3 : 2));
    CHECK(s.truncated == (all ? 2 : 1));
    CHECK(s.rejected == 1);
    CHECK(s.occupied == 2);
    CHECK(s.occupied == map.num_occupied_leaves());
    CHECK(s.free > 20);
  }
}

TEST_CASE("a point at exactly the range is within range") {
  const std::vector<vec3f> points{{2.0F, 0.0F, 0.0F}};
  for (const double range : {2.0, 1.999}) {
    occupancy_octree<> map{0.1};
    const auto s = map.integrate(points, vec3f::Zero(), {.max_range = range});
    CHECK(s.used == (range == 2.0 ? 1 : 0));
    CHECK(s.truncated == (range == 2.0 ? 0 : 1));
    CHECK(s.occupied == (range == 2.0 ? 1 : 0));
  }
}

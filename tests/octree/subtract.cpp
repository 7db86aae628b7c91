// SPDX-License-Identifier: BSD-3-Clause
#include <vector>

#include <orbis/octree/subtract.hpp>

#include "octree/support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

namespace {

/// A model that is never at its bounds, so that nothing is lost.
struct patient : log_odds<> {
  static constexpr float clamp_min = -1000.0F;
  static constexpr float clamp_max = 1000.0F;
};

struct scan {
  vec3f origin;
  std::vector<vec3f> points;
};

std::vector<scan> scans(std::uint64_t seed, int count) {
  random_bits random{seed};
  std::vector<scan> all;
  for (int i = 0; i != count; ++i) {
    const vec3f origin = test::random_points(random, 1, 0.3)[0];
    all.push_back({origin, test::shell_scan(random, 400, origin)});
  }
  return all;
}

}  // namespace

TEST_CASE("A scan taken out again leaves the map as if it had never been") {
  const auto all = scans(1, 6);
  for (const ray_mode mode : {ray_mode::every_ray, ray_mode::discretized}) {
    const integration_options options{.max_range = 1.6, .mode = mode};
    occupancy_octree<patient> map{0.1}, without{0.1};
    for (std::size_t i = 0; i != all.size(); ++i) {
      map.integrate(all[i].points, all[i].origin, options);
      if (i != 2) without.integrate(all[i].points, all[i].origin, options);
    }
    const auto summary = subtract(map, all[2].points, all[2].origin, options);
    CHECK(summary.lost == 0);
    CHECK(summary.restored > 1000);
    CHECK(summary.forgotten > 0);
    std::size_t known = 0;
    random_bits random{2};
    for (int i = 0; i != 100000; ++i) {
      const vec3f p = test::random_points(random, 1, 2.0)[0];
      const auto got = map.value(p), expected = without.value(p);
      REQUIRE(got.has_value() == expected.has_value());
      if (!got) continue;
      ++known;
      REQUIRE(*got == Approx(*expected).margin(1e-5));
    }
    CHECK(known > 10000);
  }
}

TEST_CASE("What clamping forgot is counted and left alone") {
  const auto all = scans(3, 1);
  occupancy_octree<> map{0.1};
  for (int i = 0; i != 10; ++i) map.integrate(all[0].points, all[0].origin);
  const auto before = ot_bytes(map);
  const auto summary = subtract(par.with(2), map, all[0].points, all[0].origin);
  CHECK(summary.restored == 0);
  CHECK(summary.lost > 1000);
  CHECK(ot_bytes(map) == before);
}

TEST_CASE("Taking out what was never there or the only scan there was") {
  const auto all = scans(4, 2);
  occupancy_octree<> map{0.1};
  CHECK(subtract(map, all[0].points, all[0].origin).restored == 0);
  CHECK(map.empty());
  const auto added = map.integrate(all[0].points, all[0].origin);
  const auto summary = subtract(map, all[0].points, all[0].origin);
  CHECK(summary.restored == added.free + added.occupied);
  CHECK(summary.forgotten == summary.restored);
  CHECK(map.num_leaves() == 0);
  CHECK(map.empty());
  CHECK(map.state(all[0].points[0]) == occupancy::unknown);
}

TEST_CASE("A scan is taken out of leaves bigger than a brick") {
  occupancy_octree<> map{0.1}, bricks{0.1};
  for (std::uint32_t i = 0; i != 8; ++i)
    bricks.set_unknown_node({32768 + 8 * (i & 1U), 32768 + 8 * (i >> 1U & 1U), 32768 + 8 * (i >> 2U)}, 13, -0.8F);
  map = bricks;
  map.prune();
  REQUIRE(map.store().has_large());
  const std::vector<vec3f> points{{1.55F, 0.75F, 0.75F}};
  const vec3f origin{0.05F, 0.75F, 0.75F};
  const auto expected = subtract(bricks, points, origin), got = subtract(map, points, origin);
  CHECK(got.restored == 16);
  CHECK(got.restored == expected.restored);
  CHECK(ot_bytes(map) == ot_bytes(bricks));
}

// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <limits>
#include <vector>

#include <orbis/octree/occupancy_octree-inl.hpp>

#include "octree/support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;

namespace {

constexpr double no_limit = std::numeric_limits<double>::infinity();

/// A map and its reference, fed with the same scans.
struct twins {
  occupancy_octree<> ours;
  octomap::OcTree theirs;

  explicit twins(double resolution) : ours{resolution}, theirs{resolution} {}
  integration_summary insert(const std::vector<vec3f>& points, const vec3f& origin,
                             const integration_options& options) {
    test::insert(theirs, points, origin, options);
    return ours.integrate(points, origin, options);
  }
  [[nodiscard]] bool equal() const { return ot_bytes(ours) == test::ot_of(theirs); }
};

struct cautious : log_odds<> {
  static constexpr float hit = 0.1F;
  static constexpr float occupancy_threshold = 0.25F;
};

}  // namespace

TEST_CASE("Random scans give OctoMap's map bit for bit in both modes at every resolution and range") {
  random_bits random{31};
  for (const double resolution : {0.02, 0.05, 0.1})
    for (const ray_mode mode : {ray_mode::every_ray, ray_mode::discretized})
      for (const double max_range : {no_limit, 1.2, 0.3}) {
        twins maps{resolution};
        for (int scan = 0; scan != 4; ++scan) {
          const vec3f origin = test::random_points(random, 1, 0.5)[0];
          const auto points =
              scan % 2 == 0 ? test::shell_scan(random, 400, origin) : test::random_points(random, 150, 1.5);
          maps.insert(points, origin, {.max_range = max_range, .mode = mode});
        }
        INFO(resolution << " m, mode " << static_cast<int>(mode) << ", range " << max_range);
        REQUIRE(maps.equal());
      }
}

TEST_CASE("Mixing modes and repeating scans until voxels reach their bounds stays OctoMap's map") {
  random_bits random{32};
  twins maps{0.1};
  for (int scan = 0; scan != 40; ++scan) {
    const vec3f origin = test::random_points(random, 1, 0.2)[0];
    maps.insert(test::shell_scan(random, 600, origin), origin,
                {.max_range = scan % 3 == 0 ? 1.5 : no_limit,
                 .mode = scan % 2 == 0 ? ray_mode::every_ray : ray_mode::discretized});
    if (scan % 10 == 9) {
      REQUIRE(maps.equal());
    }
  }
  const octree_counts counts = maps.ours.counts();
  CHECK(counts.nodes == maps.theirs.size());
  CHECK(counts.leaves == maps.theirs.getNumLeafNodes());
  CHECK(counts.leaves == counts.occupied_leaves + counts.free_leaves);
  CHECK(maps.ours.size() == counts.nodes);
  CHECK(maps.ours.num_leaves() == counts.leaves);
  CHECK(maps.ours.num_occupied_leaves() == counts.occupied_leaves);
  CHECK(maps.ours.num_free_leaves() == counts.free_leaves);
}

TEST_CASE("Degenerate scans give OctoMap's map") {
  const float face = 0.5F;
  const std::vector<vec3f> points{{1.0F, 0.0F, 0.0F},   {0.0F, 1.0F, 0.0F},   {0.0F, 0.0F, -1.0F},   {1.0F, 1.0F, 1.0F},
                                  {-1.0F, 1.0F, -1.0F}, {0.5F, 0.5F, 0.5F},   {0.05F, 0.05F, 0.05F}, {0.0F, 0.0F, 0.0F},
                                  {0.5F, 0.5F, 1.5F},   {-0.5F, -0.5F, 0.5F}, {1000.0F, 0.0F, 0.0F}};
  for (const vec3f& origin : {vec3f{0.0F, 0.0F, 0.0F}, vec3f{face, face, face}, vec3f{0.025F, 0.025F, 0.025F}})
    for (const ray_mode mode : {ray_mode::every_ray, ray_mode::discretized})
      for (const double max_range : {no_limit, 1.0, 0.0}) {
        twins maps{0.05};
        maps.insert(points, origin, {.max_range = max_range, .mode = mode});
        REQUIRE(maps.equal());
      }
}

TEST_CASE("Points far outside the grid are truncated to the range or rejected") {
  const std::vector<vec3f> points{{1e6F, 0.0F, 0.0F}, {0.0F, -1e30F, 0.0F}, {1.0F, 0.0F, 0.0F}};
  twins with_range{0.1};
  const auto summary = with_range.insert(points, vec3f::Zero(), {.max_range = 2.0});
  CHECK(with_range.equal());
  CHECK(summary.used == 1);
  CHECK(summary.truncated == 1);
  CHECK(summary.rejected == 1);

  twins without{0.1};
  const auto all = without.insert(points, vec3f::Zero(), {});
  CHECK(without.equal());
  CHECK(all.used == 1);
  CHECK(all.rejected == 2);
}

TEST_CASE("A scan too wide for a dense window gives OctoMap's map") {
  random_bits random{38};
  auto points = test::random_points(random, 60, 1.0);
  for (vec3f& p : points) p *= 60.0F;
  for (const ray_mode mode : {ray_mode::every_ray, ray_mode::discretized}) {
    twins maps{0.05};
    maps.insert(points, {0.3F, 0.1F, -0.2F}, {.mode = mode});
    maps.insert({{1635.0F, 0.0F, 1.0F}, {0.5F, 0.1F, 0.2F}}, {1630.0F, 0.0F, 0.0F}, {.max_range = 20.0, .mode = mode});
    CHECK(maps.equal());
  }
}

TEST_CASE("A sensor outside the grid marks end points but no rays") {
  twins maps{0.1};
  maps.insert({{1.0F, 0.0F, 0.0F}, {3000.0F, 0.0F, 0.0F}}, {5000.0F, 0.0F, 0.0F}, {});
  CHECK(maps.equal());
  CHECK(maps.ours.num_occupied_leaves() == 2);
  CHECK(maps.ours.num_free_leaves() == 0);
}

TEST_CASE("Points that are no numbers are rejected and counted and leave no trace") {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  constexpr float inf = std::numeric_limits<float>::infinity();
  random_bits random{33};
  const auto good = test::shell_scan(random, 300, vec3f::Zero());
  for (const ray_mode mode : {ray_mode::every_ray, ray_mode::discretized})
    for (const double max_range : {no_limit, 1.0}) {
      auto mixed = good;
      mixed.insert(mixed.begin(), vec3f{nan, 0.0F, 0.0F});
      mixed.insert(mixed.begin() + 100, vec3f{0.0F, inf, 0.0F});
      mixed.push_back({-inf, nan, 1.0F});
      const integration_options options{.max_range = max_range, .mode = mode};
      occupancy_octree<> clean{0.05}, dirty{0.05};
      const auto expected = clean.integrate(good, vec3f{0.0F, 0.0F, 0.0F}, options);
      const auto got = dirty.integrate(mixed, vec3f{0.0F, 0.0F, 0.0F}, options);
      CHECK(got.rejected == 3);
      CHECK(got.used == expected.used);
      CHECK(got.truncated == expected.truncated);
      CHECK(got.free == expected.free);
      CHECK(got.occupied == expected.occupied);
      CHECK(ot_bytes(clean) == ot_bytes(dirty));

      const auto nowhere = dirty.integrate(good, vec3f{nan, 0.0F, 0.0F}, options);
      CHECK(nowhere.rejected == good.size());
      CHECK(nowhere.free + nowhere.occupied == 0);
      CHECK(ot_bytes(clean) == ot_bytes(dirty));
    }
}

TEST_CASE("The map does not depend on the order of points or the number of threads") {
  random_bits random{34};
  for (const ray_mode mode : {ray_mode::every_ray, ray_mode::discretized}) {
    auto points = test::shell_scan(random, 30000, vec3f::Zero());
    const integration_options options{.max_range = 1.55, .mode = mode};
    occupancy_octree<> one{0.05}, three{0.05}, reversed{0.05};
    const auto a = one.integrate(points, vec3f{0.0F, 0.0F, 0.0F}, options);
    const auto b = three.integrate(par.with(3), points, vec3f{0.0F, 0.0F, 0.0F}, options);
    std::reverse(points.begin(), points.end());
    reversed.integrate(points, vec3f{0.0F, 0.0F, 0.0F}, options);
    CHECK(ot_bytes(one) == ot_bytes(three));
    CHECK(ot_bytes(one) == ot_bytes(reversed));
    CHECK(a.used == b.used);
    CHECK(a.truncated == b.truncated);
    CHECK(a.free == b.free);
    CHECK(a.occupied == b.occupied);
    CHECK(a.used + a.truncated > 0);
  }
}

TEST_CASE("Any kind of point range can be integrated") {
  struct survey_point {
    double x, y, z;
  };
  const std::vector<survey_point> a{{1.0, 0.2, 0.3}};
  const std::vector<std::array<float, 3>> b{{1.0F, 0.2F, 0.3F}};
  const std::vector<vec3> c{{1.0, 0.2, 0.3}};
  occupancy_octree<> from_a{0.1}, from_b{0.1}, from_c{0.1};
  from_a.integrate(a, survey_point{0.0, 0.0, 0.0});
  from_b.integrate(b, vec3{0.0, 0.0, 0.0});
  from_c.integrate(c, std::array{0.0F, 0.0F, 0.0F});
  CHECK(ot_bytes(from_a) == ot_bytes(from_b));
  CHECK(ot_bytes(from_a) == ot_bytes(from_c));
  CHECK(from_a.state(vec3{1.0, 0.2, 0.3}) == occupancy::occupied);
}

TEST_CASE("State log-odds and probability of every voxel are OctoMap's") {
  random_bits random{35};
  twins maps{0.05};
  for (int scan = 0; scan != 12; ++scan) {
    const vec3f origin = test::random_points(random, 1, 0.3)[0];
    maps.insert(test::shell_scan(random, 800, origin), origin, {});
  }
  int known = 0;
  for (int i = 0; i != 40000; ++i) {
    const vec3f p = test::random_points(random, 1, 2.5)[0];
    const octomap::OcTreeNode* const node = maps.theirs.search(test::to_octomap(p));
    const auto log_odds = maps.ours.log_odds(p);
    REQUIRE(log_odds.has_value() == (node != nullptr));
    REQUIRE(maps.ours.probability(p).has_value() == (node != nullptr));
    if (node == nullptr) {
      REQUIRE(maps.ours.state(p) == occupancy::unknown);
      continue;
    }
    ++known;
    REQUIRE(*log_odds == node->getLogOdds());
    REQUIRE(*maps.ours.probability(p) == Approx(node->getOccupancy()));
    REQUIRE((maps.ours.state(p) == occupancy::occupied) == maps.theirs.isNodeOccupied(node));
    REQUIRE(maps.ours.state(*maps.ours.grid().key(p)) == maps.ours.state(p));
  }
  CHECK(known > 1000);
  CHECK(maps.ours.state(vec3{1e9, 0.0, 0.0}) == occupancy::unknown);
}

TEST_CASE("The leaves are OctoMap's in OctoMap's order") {
  random_bits random{36};
  twins maps{0.1};
  for (int scan = 0; scan != 12; ++scan) maps.insert(test::shell_scan(random, 800, vec3f::Zero()), vec3f::Zero(), {});
  auto it = maps.theirs.begin_leafs();
  bool some_pruned = false;
  maps.ours.for_each_leaf([&](const occupancy_octree<>::leaf& leaf) {
    REQUIRE(it != maps.theirs.end_leafs());
    REQUIRE(leaf.depth == static_cast<int>(it.getDepth()));
    REQUIRE(leaf.log_odds == it->getLogOdds());
    REQUIRE(leaf.occupied == maps.theirs.isNodeOccupied(*it));
    REQUIRE(leaf.size == it.getSize());
    REQUIRE(leaf.center.x() == it.getX());
    REQUIRE(leaf.center.y() == it.getY());
    REQUIRE(leaf.center.z() == it.getZ());
    some_pruned = some_pruned || leaf.depth < maps.ours.tree_depth();
    ++it;
  });
  CHECK(it == maps.theirs.end_leafs());
  CHECK(some_pruned);

  const auto bounds = maps.ours.bounds();
  REQUIRE(bounds);
  vec3 low, high;
  maps.theirs.getMetricMin(low.x(), low.y(), low.z());
  maps.theirs.getMetricMax(high.x(), high.y(), high.z());
  CHECK(bounds->min.isApprox(low));
  CHECK(bounds->max.isApprox(high));
}

TEST_CASE("An empty map knows nothing and a cleared one forgets everything") {
  occupancy_octree<> map{0.05};
  CHECK(map.empty());
  CHECK(map.size() == 0);
  CHECK(map.num_leaves() == 0);
  CHECK_FALSE(map.bounds());
  CHECK(map.memory_bytes() == 0);
  const auto none = map.integrate(std::vector<vec3f>{}, vec3f{0.0F, 0.0F, 0.0F});
  CHECK(none.used + none.rejected + none.free + none.occupied == 0);
  CHECK(map.empty());

  map.integrate(std::vector<vec3f>{{1.0F, 0.0F, 0.0F}}, vec3f{0.0F, 0.0F, 0.0F});
  CHECK_FALSE(map.empty());
  CHECK(map.memory_bytes() > 0);
  const occupancy_octree<> copy = map;
  map.clear();
  CHECK(map.empty());
  CHECK(map.memory_bytes() == 0);
  CHECK(map.resolution() == 0.05);
  CHECK(copy.state(vec3{1.0, 0.0, 0.0}) == occupancy::occupied);
}

TEST_CASE("Equal neighbours are one leaf and take less memory than their voxels") {
  random_bits random{37};
  occupancy_octree<> map{0.05};
  const auto points = test::shell_scan(random, 20000, vec3f::Zero());
  const auto first = map.integrate(points, vec3f{0.0F, 0.0F, 0.0F});
  const std::size_t voxels = first.free + first.occupied;
  CHECK(voxels > 50000);
  CHECK(2 * map.num_leaves() < voxels);
  CHECK(map.memory_bytes() < 8 * voxels);
  const std::size_t bytes = map.memory_bytes();
  for (int i = 0; i != 10; ++i) map.integrate(points, vec3f{0.0F, 0.0F, 0.0F});
  CHECK(2 * map.num_leaves() < voxels);
  CHECK(map.memory_bytes() <= bytes + bytes / 2);
}

TEST_CASE("A sensor model with other constants is obeyed") {
  occupancy_octree<cautious> map{0.1};
  const std::vector<vec3f> points{{1.0F, 0.0F, 0.0F}};
  const vec3f origin{0.05F, 0.0F, 0.0F};
  for (int i = 1; i != 6; ++i) {
    map.integrate(points, origin);
    CHECK(map.state(points[0]) == (i < 3 ? occupancy::free : occupancy::occupied));
  }
}

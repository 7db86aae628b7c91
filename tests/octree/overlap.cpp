// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <vector>

#include <orbis/octree/overlap.hpp>

#include "octree/support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;

namespace {

occupancy_octree<> shell_map() {
  random_bits random{81};
  occupancy_octree<> map{0.1};
  for (int i = 0; i != 4; ++i) {
    const vec3f origin{0.1F * static_cast<float>(i), 0.0F, 0.0F};
    map.integrate(test::shell_scan(random, 4000, origin), origin);
  }
  return map;
}

/// From a point to a cube with this centre.
double distance(const vec3& p, const vec3& center, double half) {
  double squares = 0.0;
  for (int i = 0; i != 3; ++i) {
    const double d = std::max(0.0, std::fabs(p[i] - center[i]) - half);
    squares += d * d;
  }
  return std::sqrt(squares);
}
double gap(const sphere& s, const vec3& center, double half) { return distance(s.center, center, half) - s.radius; }
double gap(const bounding_box& b, const vec3& center, double half) {
  const vec3 away = (center - (b.min + b.max) / 2.0).cwiseAbs() - (b.max - b.min) / 2.0;
  return away.maxCoeff() - half;
}
/// By nested intervals: the distance is convex along the segment.
double gap(const capsule& c, const vec3& center, double half) {
  const double length = (c.b - c.a).norm();
  if (const double least = distance((c.a + c.b) / 2.0, center, half) - length / 2.0 - c.radius; least > 1e-6)
    return least;
  double low = 0.0, high = 1.0;
  const auto at = [&](double t) { return distance(c.a + t * (c.b - c.a), center, half); };
  for (int i = 0; i != 45; ++i) {
    const double m = low + (high - low) / 3.0, n = high - (high - low) / 3.0;
    (at(m) < at(n) ? high : low) = at(m) < at(n) ? n : m;
  }
  return at(low) - c.radius;
}

struct answer {
  bool occupied = false, unknown = false;
  bool is_close = false;  ///< rounding may decide
};
template <class Shape>
answer by_brute_force(const occupancy_octree<>& map, const Shape& shape) {
  answer a;
  const auto keys = keys_between(map.grid(), bounds_of(shape).min.array() - 0.2, bounds_of(shape).max.array() + 0.2);
  REQUIRE(keys);
  for (std::uint32_t x = keys->low.x; x <= keys->high.x; ++x)
    for (std::uint32_t y = keys->low.y; y <= keys->high.y; ++y)
      for (std::uint32_t z = keys->low.z; z <= keys->high.z; ++z) {
        const double g = gap(shape, map.grid().center(voxel_key{x, y, z}), 0.05);
        a.is_close = a.is_close || std::fabs(g) < 1e-9;
        if (g > 0.0) continue;
        const occupancy state = map.state(voxel_key{x, y, z});
        a.occupied = a.occupied || state == occupancy::occupied;
        a.unknown = a.unknown || state == occupancy::unknown;
      }
  return a;
}
template <class Shape>
bool check(const occupancy_octree<>& map, const Shape& shape) {
  const answer expected = by_brute_force(map, shape);
  if (expected.is_close) return false;
  REQUIRE(overlaps(map, shape) == expected.occupied);
  REQUIRE(overlaps(map, shape, {.unknown = occupancy::occupied}) == (expected.occupied || expected.unknown));
  return expected.occupied;
}

}  // namespace

TEST_CASE("Boxes, spheres and capsules overlap what they overlap voxel by voxel") {
  const occupancy_octree<> map = shell_map();
  random_bits random{82};
  int hits[3] = {};
  constexpr int rounds = 150;
  for (int i = 0; i != rounds; ++i) {
    const auto point = [&](double half) { return vec3(test::random_points(random, 1, half)[0].cast<double>()); };
    const double radius = random.uniform(0.0, 0.4);
    const vec3 a = point(1.6), b = a + point(0.7);
    hits[0] += check(map, bounding_box{a.cwiseMin(b), a.cwiseMax(b)}) ? 1 : 0;
    hits[1] += check(map, sphere{a, radius}) ? 1 : 0;
    hits[2] += check(map, capsule{a, i % 10 == 0 ? a : b, radius}) ? 1 : 0;
    check(map, capsule{a, vec3{b.x(), a.y(), a.z()}, radius});  // along an axis
  }
  for (const int n : hits) {
    CHECK(n > rounds / 10);
    CHECK(n < rounds - rounds / 10);
  }
}

TEST_CASE("Touching is overlapping, and outside the grid nothing is known") {
  occupancy_octree<> map{0.125};                          // exact in binary
  map.set_unknown_node({32768, 32768, 32768}, 16, 1.0F);  // from 0 to 0.125
  CHECK(overlaps(map, bounding_box{{0.125, 0.125, 0.125}, {0.2, 0.2, 0.2}}));
  CHECK(overlaps(map, sphere{{-0.5, 0.1, 0.1}, 0.5}));
  CHECK(overlaps(map, capsule{{0.1, -0.25, 0.1}, {0.3, -0.25, 0.1}, 0.25}));
  CHECK(!overlaps(map, sphere{{-0.5, 0.1, 0.1}, 0.4999}));
  CHECK(overlaps(map, sphere{{0.06, 0.06, 0.06}, 0.0}));
  CHECK(!overlaps(map, sphere{{1e6, 0.0, 0.0}, 1.0}));
  CHECK(overlaps(map, sphere{{1e6, 0.0, 0.0}, 1.0}, {.unknown = occupancy::occupied}));
  CHECK(overlaps(map, sphere{{0.0, 0.0, 0.0}, 1e6}));
  CHECK(overlaps(map, bounding_box{{-1e9, -1e9, -1e9}, {1e9, 1e9, 1e9}}));
}

TEST_CASE("Leaves larger than a brick block and let through as their voxels would") {
  occupancy_octree<> map{0.1};
  const voxel_key base{32768, 32768, 32768};
  for (unsigned i = 0; i != 8; ++i) map.set_unknown_node(child_key(base, i, 16), 12, i == 7 ? 1.0F : -1.0F);
  random_bits random{83};
  int hits = 0;
  for (int i = 0; i != 300; ++i) {
    const vec3 a = vec3::Constant(1.6) + vec3(test::random_points(random, 1, 1.5)[0].cast<double>());
    hits += check(map, sphere{a, random.uniform(0.0, 0.5)}) ? 1 : 0;
  }
  CHECK(hits > 20);
}

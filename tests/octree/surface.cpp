// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <vector>

#include <orbis/octree/surface.hpp>

#include "octree/support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

namespace {

constexpr double degree = 3.14159265358979323846 / 180.0;

/// A map in which a voxel within reach is occupied or free as `inside(centre)` says.
template <class Inside>
occupancy_octree<> solid(double resolution, double reach, Inside&& inside) {
  occupancy_octree<> map{resolution};
  const auto keys = keys_between(map.grid(), vec3::Constant(-reach), vec3::Constant(reach));
  for (std::uint32_t x = keys->low.x; x <= keys->high.x; ++x)
    for (std::uint32_t y = keys->low.y; y <= keys->high.y; ++y)
      for (std::uint32_t z = keys->low.z; z <= keys->high.z; ++z)
        map.set_unknown_node({x, y, z}, 16, inside(map.grid().center(voxel_key{x, y, z})) ? 3.5F : -2.0F);
  return map;
}
double angle(const vec3& a, const vec3& b) { return std::acos(std::clamp(a.dot(b), -1.0, 1.0)); }

}  // namespace

TEST_CASE("Normals of planes point to free space") {
  random_bits random{91};
  for (int round = 0; round != 12; ++round) {
    vec3 normal = vec3::Zero();
    if (round < 3)
      normal[round] = 1.0;
    else
      normal = test::random_points(random, 1, 1.0)[0].cast<double>().normalized();
    const auto map = solid(0.1, 1.0, [&](const vec3& p) { return p.dot(normal) < 0.013; });
    std::vector<double> errors;
    normal_estimator estimate{map};
    visit_occupied_voxels<octree::log_odds<>>(map.store(), [&](const voxel_key& k, float) {
      const vec3 p = map.grid().center(k);
      if (p.cwiseAbs().maxCoeff() > 0.8 || p.dot(normal) < -0.087) return;  // away from the border, at the surface
      const auto n = estimate(k);
      REQUIRE(n);
      CHECK(std::fabs(n->norm() - 1.0) < 1e-12);
      errors.push_back(angle(*n, normal));
    });
    REQUIRE(errors.size() > 100);
    std::sort(errors.begin(), errors.end());
    if (round < 3) CHECK(errors.back() < 1e-6);  // along an axis
    CHECK(errors[errors.size() / 2] < 15.0 * degree);
    CHECK(errors.back() < 30.0 * degree);
  }
}

TEST_CASE("Normals of a sphere point outwards") {
  const auto map = solid(0.05, 1.2, [](const vec3& p) { return p.norm() < 1.0; });
  std::vector<double> errors;
  std::size_t without = 0;
  for_each_surface_voxel(map, [&](const voxel_key& k, const vec3& center, const std::optional<vec3>& n) {
    REQUIRE(center == map.grid().center(k));
    if (center.norm() < 0.8) {  // everything around it is occupied
      without += n ? 0 : 1;
      return;
    }
    if (center.norm() > 0.96) {
      REQUIRE(n);
      errors.push_back(angle(*n, center.normalized()));
    }
  });
  CHECK(without > 1000);
  REQUIRE(errors.size() > 1000);
  std::sort(errors.begin(), errors.end());
  CHECK(errors[errors.size() / 2] < 8.0 * degree);
  CHECK(errors.back() < 30.0 * degree);
}

TEST_CASE("Unknown space counts as told, and lies between free and occupied unless told") {
  occupancy_octree<> map{0.1};  // a wall seen from one side: free, occupied, unknown
  for (std::uint32_t y = 0; y != 9; ++y)
    for (std::uint32_t z = 0; z != 9; ++z) {
      map.set_unknown_node({40001, 40000 + y, 40000 + z}, 16, -2.0F);
      map.set_unknown_node({40002, 40000 + y, 40000 + z}, 16, 3.5F);
    }
  const voxel_key middle{40002, 40004, 40004};
  const auto normal = normal_estimator{map}(middle);
  REQUIRE(normal);
  CHECK(angle(*normal, -vec3::UnitX()) < 1e-6);
  const auto solid_behind = normal_estimator{map, {.unknown = occupancy::occupied}}(middle);
  REQUIRE(solid_behind);
  CHECK(angle(*solid_behind, -vec3::UnitX()) < 1e-6);
  CHECK(!normal_estimator{map}(voxel_key{0, 5, 5}));
  CHECK(!normal_estimator{map}(voxel_key{5, 5, 65535}));
  CHECK(!normal_estimator{map}(voxel_key{1000, 1000, 1000}));
}

TEST_CASE("The occupied centres are those of the occupied leaves, voxel by voxel") {
  random_bits random{92};
  occupancy_octree<> map{0.05};
  map.integrate(test::shell_scan(random, 2000, vec3f::Zero()), vec3f::Zero());
  map.set_unknown_node({40000, 40000, 40000}, 14, 1.0F);
  std::size_t expected = 0;
  map.for_each_leaf([&](const auto& l) {
    const std::size_t size = node_cells(map.tree_depth() - l.depth);
    expected += l.occupied ? size * size * size : 0;
  });
  const std::vector<vec3f> centers = occupied_centers(map);
  CHECK(centers.size() == expected);
  for (const vec3f& c : centers) REQUIRE(map.state(c) == occupancy::occupied);
}

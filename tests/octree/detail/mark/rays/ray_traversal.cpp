// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>
#include <vector>

#include <orbis/octree/detail/mark/rays/ray_traversal.hpp>

#include "octree/support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

namespace {

/// Our walk and OctoMap's must give the same keys in the same order.
void check_ray(const voxel_grid& grid, const octomap::OcTree& tree, const vec3f& origin, const vec3f& end) {
  octomap::KeyRay expected;
  const bool walked = tree.computeRayKeys(test::to_octomap(origin), test::to_octomap(end), expected);
  const auto from = grid.key(origin);
  const auto to = grid.key(end);
  REQUIRE(walked == (from && to));
  if (!walked) return;
  std::vector<voxel_key> got;
  traverse_ray(grid, coordinates<float>(origin), *from, coordinates<float>(end), *to,
               [&](const voxel_key& k) { got.push_back(k); });
  REQUIRE(got.size() == expected.size());
  std::size_t i = 0;
  for (const octomap::OcTreeKey& k : expected) REQUIRE(got[i++] == voxel_key{k[0], k[1], k[2]});
}

}  // namespace

TEST_CASE("A ray crosses the voxels that OctoMap says it crosses") {
  random_bits random{21};
  for (const double resolution : {0.02, 0.05, 0.1, 0.37}) {
    const voxel_grid grid{resolution};
    const octomap::OcTree tree{resolution};
    for (int i = 0; i != 3000; ++i) {
      const auto ends = test::random_points(random, 2, 3.0);
      check_ray(grid, tree, ends[0], ends[1]);
    }
  }
}

TEST_CASE("Degenerate rays cross the voxels that OctoMap says they cross") {
  random_bits random{22};
  for (const double resolution : {0.02, 0.05, 0.1, 0.125}) {
    const voxel_grid grid{resolution};
    const octomap::OcTree tree{resolution};
    const auto on_grid = [&] {  // corners, faces and edges of voxels, and points a float beside them
      auto c = static_cast<float>((static_cast<int>(random.below(41)) - 20) * resolution);
      if (random.below(4) == 0) c = std::nextafter(c, random.below(2) == 0 ? 9.0F : -9.0F);
      return c;
    };
    for (int i = 0; i != 5000; ++i) {
      const vec3f origin{on_grid(), on_grid(), on_grid()};
      vec3f end{on_grid(), on_grid(), on_grid()};
      for (int axis = 0; axis != 3; ++axis)
        if (random.below(3) == 0) end[axis] = origin[axis];  // parallel to a face, to an axis, or no length
      check_ray(grid, tree, origin, end);
    }
  }
}

TEST_CASE("Rays along and across the border of the grid end") {
  const voxel_grid grid{0.1};
  const octomap::OcTree tree{0.1};
  check_ray(grid, tree, {3270.0F, 0.0F, 0.0F}, {3276.75F, 0.05F, 0.0F});
  check_ray(grid, tree, {-3270.0F, 1.0F, 3276.7F}, {-3276.75F, 1.05F, 3276.7F});
  check_ray(grid, tree, {0.0F, 0.0F, 0.0F}, {4000.0F, 0.0F, 0.0F});
  check_ray(grid, tree, {4000.0F, 0.0F, 0.0F}, {0.0F, 0.0F, 0.0F});
  // OctoMap makes integers of such numbers, which gives another one on each processor.
  CHECK(!grid.key(vec3f{std::numeric_limits<float>::quiet_NaN(), 0.0F, 0.0F}));
  CHECK(!grid.key(vec3f{0.0F, std::numeric_limits<float>::infinity(), 0.0F}));
}

TEST_CASE("Of a ray that is too short for a float only the first voxel counts") {
  const voxel_grid grid{1e-25};
  const float3 origin{0.0F, 0.0F, 0.0F}, end{3e-25F, 0.0F, 0.0F};
  int visits = 0;
  traverse_ray(grid, origin, *grid.key(origin), end, *grid.key(end), [&](const voxel_key&) { ++visits; });
  CHECK(visits == 1);
}

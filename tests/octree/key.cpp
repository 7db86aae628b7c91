// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include <orbis/core/random.hpp>
#include <orbis/octree/key.hpp>

#include "octree/support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;

TEST_CASE("Keys and centres are OctoMap's") {
  random_bits random{7};
  for (const double resolution : {0.02, 0.05, 0.1, 0.3}) {
    const voxel_grid grid{resolution};
    const octomap::OcTree tree{resolution};
    for (int i = 0; i != 20000; ++i) {
      // Coordinates on and beside voxel faces, where the last bit decides.
      auto c = static_cast<float>((static_cast<int>(random.below(400)) - 200) * resolution);
      if (random.below(2) == 0) c = std::nextafter(c, random.below(2) == 0 ? 100.0F : -100.0F);
      octomap::key_type key = 0;
      REQUIRE(tree.coordToKeyChecked(static_cast<double>(c), key));
      REQUIRE(grid.key(static_cast<double>(c)) == std::uint32_t{key});
      REQUIRE(grid.center(std::uint32_t{key}) == tree.keyToCoord(key));
    }
  }
}

TEST_CASE("Floats just below a face fall where OctoMap lets them fall") {
  const voxel_grid grid{0.05};
  CHECK(grid.key(static_cast<double>(0.35F)) == 32768U + 6U);
  CHECK(grid.key(static_cast<double>(0.7F)) == 32768U + 13U);
  CHECK(grid.key(static_cast<double>(-0.05F)) == 32768U - 2U);
}

TEST_CASE("There is no key outside the grid and none for what is not a number") {
  const voxel_grid grid{0.1};
  CHECK(grid.key(3276.75));
  CHECK(grid.key(3276.75) == 65535U);
  CHECK_FALSE(grid.key(3276.85));
  CHECK(grid.key(-3276.75) == 0U);
  CHECK_FALSE(grid.key(-3276.85));
  CHECK_FALSE(grid.key(1e300));
  CHECK_FALSE(grid.key(std::numeric_limits<double>::infinity()));
  CHECK_FALSE(grid.key(-std::numeric_limits<double>::infinity()));
  CHECK_FALSE(grid.key(std::numeric_limits<double>::quiet_NaN()));
  CHECK_FALSE(grid.key(vec3f{0.0F, std::numeric_limits<float>::quiet_NaN(), 0.0F}));
}

TEST_CASE("A node's centre and size at every depth are OctoMap's") {
  const voxel_grid grid{0.05};
  const octomap::OcTree tree{0.05};
  random_bits random{3};
  for (int i = 0; i != 2000; ++i) {
    const octomap::OcTreeKey k{static_cast<octomap::key_type>(random.below(65536)),
                               static_cast<octomap::key_type>(random.below(65536)),
                               static_cast<octomap::key_type>(random.below(65536))};
    for (int depth = 0; depth <= default_tree_depth; ++depth) {
      const int level = default_tree_depth - depth;
      const vec3 center = grid.center(node_key({k[0], k[1], k[2]}, level), level);
      for (unsigned axis = 0; axis != 3; ++axis)
        REQUIRE(center[axis] == Approx(tree.keyToCoord(k[axis], static_cast<unsigned>(depth))).margin(1e-9));
      REQUIRE(grid.node_size(level) == tree.getNodeSize(static_cast<unsigned>(depth)));
    }
  }
}

TEST_CASE("A deeper grid reaches further and has the same voxels") {
  const voxel_grid usual{0.05}, deep{0.05, 21};
  CHECK(deep.cells() == 1U << 21U);
  CHECK_FALSE(usual.key(50000.0));
  CHECK(deep.key(50000.0));
  random_bits random{4};
  for (int i = 0; i != 2000; ++i) {
    const double c = random.uniform(-1600.0, 1600.0);
    const std::uint32_t k = *usual.key(c);
    REQUIRE(*deep.key(c) - deep.cells() / 2 == k - usual.cells() / 2);
    REQUIRE(deep.center(*deep.key(c)) == usual.center(k));
  }
}
TEST_CASE("A Morton code has the bits of x y and z in turn and leads back to its voxel") {
  orbis::random_bits random{17};
  for (int run = 0; run != 20000; ++run) {
    const auto any = [&] { return random.below(1U << (1 + random.below(21))); };
    const voxel_key key{any(), any(), any()};
    std::uint64_t code = 0;
    for (unsigned bit = 0; bit != 21; ++bit)
      code |= std::uint64_t{key.x >> bit & 1U} << (3 * bit) | std::uint64_t{key.y >> bit & 1U} << (3 * bit + 1) |
              std::uint64_t{key.z >> bit & 1U} << (3 * bit + 2);
    REQUIRE(morton_code(key) == code);
    REQUIRE(morton_key(code) == key);
  }
  const voxel_key last{(1U << 21U) - 1, (1U << 21U) - 1, (1U << 21U) - 1};
  CHECK(morton_code(last) == (std::uint64_t{1} << 63U) - 1);
  CHECK(morton_key(morton_code(last)) == last);
}

// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <cstdint>

#include <orbis/core/random.hpp>
#include <orbis/nav/distance_field.hpp>
#include <orbis/nav/planning_view.hpp>
#include <orbis/octree/occupancy_octree.hpp>

#include "nav/maze.hpp"
#include "support/catch.hpp"

using namespace orbis;
using octree::occupancy;
using octree::voxel_key;
using test::cell, test::is_free, test::map_type, test::maze, test::random_point;

TEST_CASE("Whether a ball is free is what the exact tests of the map say") {
  const occupancy unknown = GENERATE(occupancy::occupied, occupancy::free);
  const double reach = GENERATE(0.15, 1.0);
  random_bits random{1};
  const map_type map = maze(random, {40, 40, 24}, 60);
  const nav::distance_field field{map, {.reach = reach, .unknown = unknown}};
  std::array<int, 2> seen{};
  for (const double radius : {0.03, 0.12, 0.25}) {
    const nav::planning_view view{map, field, radius};
    for (int i = 0; i != 1500; ++i) {
      const vec3 a = random_point(random, {44, 44, 26}) - vec3::Constant(0.1);
      const vec3 b = i % 3 == 0   ? a
                     : i % 3 == 1 ? vec3{a + 0.1 * random_point(random, {10, 10, 10})}
                                  : vec3{random_point(random, {40, 40, 24})};
      const bool expected = is_free(map, a, b, radius, unknown);
      ++seen[expected ? 1 : 0];
      CHECK(view.is_free(a, b) == expected);
      const voxel_key k = *map.grid().key(a);
      const vec3 middle = map.grid().center(k);
      CHECK(view.is_free(k) == is_free(map, middle, middle, radius, unknown));
    }
  }
  CHECK(seen[0] > 500);
  CHECK(seen[1] > 500);
  const nav::planning_view view{map, field, 0.1};
  CHECK_FALSE(view.is_free(vec3{std::nan(""), 0.0, 0.0}));
  CHECK(view.is_free(vec3{0.0, 0.0, 1e6}) == (unknown == occupancy::free));
}

TEST_CASE("At the edge of the grid a ball is free where the exact tests say so") {
  const occupancy unknown = GENERATE(occupancy::occupied, occupancy::free);
  random_bits random{11};
  map_type map{cell, 5};
  const std::uint32_t cells = map.grid().cells();
  for (std::uint32_t z = 0; z != cells; ++z)
    for (std::uint32_t y = 0; y != cells; ++y)
      for (std::uint32_t x = 0; x != cells; ++x)
        map.edit_octant({x, y, z}, [&](octree::block<float>& b) {
          const auto i = octree::morton_code({x, y, z}) & 63U;
          b.known |= std::uint64_t{1} << i;
          b.value[i] = random.uniform() < 0.01 ? 1.0F : -1.0F;
        });
  const nav::distance_field field{map, {.reach = 1.0, .unknown = unknown}};
  const nav::planning_view view{map, field, 0.1};
  std::array<int, 2> seen{};
  int wrong = 0, falsely_sure = 0;
  for (int i = 0; i != 6000; ++i) {
    vec3 a{random.uniform(-1.6, 1.6), random.uniform(-1.6, 1.6), random.uniform(-1.6, 1.6)};
    a[i % 3] = (i % 2 == 0 ? 1.6 : -1.6) + random.uniform(-0.15, 0.15);
    const vec3 b = a + vec3{random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2)};
    for (const vec3& to : {a, b}) {
      const bool expected = is_free(map, a, to, 0.1, unknown);
      ++seen[expected ? 1 : 0];
      wrong += view.is_free(a, to) != expected ? 1 : 0;
      falsely_sure += view.is_surely_free(a, to) && !expected ? 1 : 0;
    }
  }
  CHECK(wrong == 0);
  CHECK(falsely_sure == 0);
  CHECK(seen[0] > 500);
  if (unknown == occupancy::free) CHECK(seen[1] > 500);
}

TEST_CASE("What the field alone calls free is free") {
  random_bits random{6};
  const map_type map = maze(random, {40, 40, 24}, 60);
  const nav::distance_field field{map, {.reach = 1.0}};
  const nav::planning_view view{map, field, 0.12};
  int sure = 0, free = 0;
  for (int i = 0; i != 2000; ++i) {
    const vec3 a = random_point(random, {40, 40, 24}), b = a + 0.1 * random_point(random, {8, 8, 8});
    const bool is_sure = view.is_surely_free(a, b);
    if (is_sure) CHECK(is_free(map, a, b, 0.12, occupancy::occupied));
    sure += is_sure ? 1 : 0;
    free += view.is_free(a, b) ? 1 : 0;
  }
  CHECK(sure > 100);
  CHECK(sure * 10 > free * 7);
  // Far beyond the grid the length of the way is not a number that steps could add up to.
  const nav::distance_field open{map, {.reach = 1.0, .unknown = occupancy::free}};
  const nav::planning_view outside{map, open, 0.12};
  const vec3 a{-1.0, -1.0, -1.0};
  CHECK(outside.is_surely_free(a, a));
  CHECK_FALSE(outside.is_surely_free(a, vec3{-1e200, -1e200, 0.0}));
}

// SPDX-License-Identifier: BSD-3-Clause
#include <limits>
#include <vector>

#include <orbis/octree/annotate.hpp>

#include "octree/support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;

TEST_CASE("Payload goes to the voxels of the points that count as hits") {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<vec3f> points{{1.01F, 0.01F, 0.01F}, {1.02F, 0.02F, 0.02F}, {0.51F, 0.0F, 0.0F}, {3.0F, 0.0F, 0.0F},
                                  {nan, 0.0F, 0.0F},     {1e9F, 0.0F, 0.0F},    {0.0F, 1.5F, 0.0F}};
  const std::vector<rgb8> colors{{10, 20, 30}, {30, 40, 50}, {1, 2, 3}, {9, 9, 9}, {9, 9, 9}, {9, 9, 9}, {7, 7, 7}};
  const voxel_grid grid{0.1};
  const vec3f origin = vec3f::Zero();
  voxel_layer<rgb_mean> layer;
  const auto update = [&](rgb_mean& c, std::size_t i) { c.update(colors[i]); };

  CHECK(annotate(layer, grid, points, origin, {.max_range = 2.0}, update) == 4);
  CHECK(layer.size() == 3);
  REQUIRE(layer.find(*grid.key(points[0])) != nullptr);
  CHECK(layer.find(*grid.key(points[0]))->count() == 2);
  CHECK(layer.find(*grid.key(points[0]))->color() == rgb8{20, 30, 40});
  CHECK(layer.find(*grid.key(points[2]))->color() == rgb8{1, 2, 3});
  CHECK(layer.find(*grid.key(points[3])) == nullptr);

  layer.clear();
  const std::vector<float> ranges{2.0F, 0.5F, 2.0F, 2.0F, 2.0F, 2.0F, nan};
  CHECK(annotate(layer, grid, points, origin, {.beam_ranges = ranges}, update) == 2);
  layer.clear();
  const bounding_box box{{0.9, -1.0, -1.0}, {1.2, 1.0, 1.0}};
  CHECK(annotate(layer, grid, points, origin, {.bounds = box}, update) == 2);
  CHECK(annotate(layer, grid, points, origin, {.bounds = bounding_box{{1e8, 0, 0}, {2e8, 1, 1}}}, update) == 0);
  CHECK(annotate(layer, grid, std::vector<vec3f>{}, origin, {}, update) == 0);
}

TEST_CASE("Every voxel with payload is an occupied voxel of the same scan and the other way round") {
  random_bits random{77};
  occupancy_octree<> map{0.1};
  voxel_layer<hit_count> hits;
  const auto points = test::shell_scan(random, 3000, vec3f::Zero());
  const integration_options options{.max_range = 1.6};
  const auto summary = map.integrate(points, vec3f{0.0F, 0.0F, 0.0F}, options);
  const std::size_t used =
      annotate(hits, map.grid(), points, vec3f{0.0F, 0.0F, 0.0F}, options, [](hit_count& h, std::size_t) { h.update(); });
  CHECK(used == summary.used);
  CHECK(hits.size() == summary.occupied);
  std::size_t counted = 0;
  hits.for_each([&](const voxel_key& k, const hit_count& h) {
    REQUIRE(map.state(k) == occupancy::occupied);
    counted += h.count();
  });
  CHECK(counted == used);
}

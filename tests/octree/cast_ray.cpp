// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <orbis/octree/cast_ray.hpp>

#include "octree/support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;

namespace {

struct scene : test::twin_maps {
  scene() : twin_maps{51, 6} {}
  /// Returns whether something was hit.
  bool check(const vec3f& origin, const vec3f& direction, double max_range, bool ignore_unknown) const {
    octomap::point3d end;
    const bool hit =
        theirs.castRay(test::to_octomap(origin), test::to_octomap(direction), end, ignore_unknown, max_range);
    const ray_hit got = ours.cast_ray(origin, direction, max_range, ignore_unknown);
    REQUIRE(static_cast<bool>(got) == hit);
    if (got.end != ray_end::no_direction && ours.grid().key(origin)) {
      for (unsigned i = 0; i != 3; ++i) REQUIRE(static_cast<float>(got.point[i]) == end(i));
    }
    return hit;
  }
};

}  // namespace

TEST_CASE("Rays end in the voxel in which OctoMap's end") {
  const scene room;
  random_bits random{52};
  int hits = 0;
  for (int i = 0; i != 4000; ++i) {
    const vec3f origin = test::random_points(random, 1, i % 2 == 0 ? 0.5 : 2.0)[0];
    const vec3f direction = test::random_points(random, 1, 3.0)[0];
    const double range = i % 3 == 0 ? 0.8 : 3.0;
    hits += room.check(origin, direction, range, i % 5 == 0) ? 1 : 0;
    if (i % 5 != 0) room.check(origin, direction, -1.0, false);
  }
  CHECK(hits > 300);
}

TEST_CASE("Rays along axes and from voxel corners end where OctoMap's end") {
  const scene room;
  random_bits random{53};
  for (int i = 0; i != 3000; ++i) {
    vec3f origin, direction;
    for (int axis = 0; axis != 3; ++axis) {
      origin[axis] = static_cast<float>((static_cast<int>(random.below(21)) - 10) * 0.05);
      direction[axis] = static_cast<float>(static_cast<int>(random.below(3)) - 1);
    }
    if (direction.isZero()) continue;
    room.check(origin, direction, 2.0, i % 2 == 0);
  }
}

TEST_CASE("A ray says why it ended") {
  occupancy_octree<> map{0.1};
  map.integrate(std::vector<vec3f>{{1.05F, 0.05F, 0.05F}}, vec3f{0.05F, 0.05F, 0.05F});
  const vec3 origin{0.05, 0.05, 0.05}, forward{2.0, 0.0, 0.0};
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(map.cast_ray(origin, forward).end == ray_end::hit);
  CHECK(map.cast_ray(origin, forward).point.isApprox(vec3{1.05, 0.05, 0.05}));
  CHECK(map.cast_ray(origin, forward, 0.5).end == ray_end::out_of_range);
  CHECK(map.cast_ray(origin, vec3{0.0, 1.0, 0.0}).end == ray_end::unknown);
  CHECK(map.cast_ray(origin, vec3{0.0, 1.0, 0.0}, 0.0, true).end == ray_end::out_of_grid);
  CHECK(map.cast_ray(origin, vec3{0.0, 0.0, 0.0}).end == ray_end::no_direction);
  CHECK(map.cast_ray(origin, vec3{nan, 0.0, 1.0}).end == ray_end::no_direction);
  CHECK(map.cast_ray(origin, vec3{1e30, 0.0, 1.0}).end == ray_end::no_direction);
  CHECK(map.cast_ray(vec3{1e9, 0.0, 0.0}, forward).end == ray_end::out_of_grid);
  CHECK(map.cast_ray(vec3{nan, 0.0, 0.0}, forward).end == ray_end::out_of_grid);
  CHECK(map.cast_ray(vec3{1.05, 0.05, 0.05}, vec3{0.0, 0.0, 0.0}).end == ray_end::hit);
}

TEST_CASE("Many rays at once end where each of them ends alone, for every number of threads") {
  const scene room;
  random_bits random{54};
  for (const ray_options& options :
       {ray_options{.max_range = 1.3, .ignore_unknown = true}, ray_options{.max_range = 6.0, .ignore_unknown = true},
        ray_options{.max_range = 2.0}, ray_options{}}) {
    const std::vector<vec3f> origins = test::random_points(random, 2000, 0.4);
    const std::vector<vec3f> directions = test::random_points(random, 2000, 3.0);
    std::vector<ray_hit> hits(directions.size()), again(directions.size());
    cast_rays(seq, room.ours, origins, directions, options, hits);
    const auto equal = [](const ray_hit& a, const ray_hit& b) {
      return a.end == b.end && a.key == b.key && a.point == b.point;
    };
    for (const unsigned threads : {2U, 7U}) {
      cast_rays(par.with(threads), room.ours, origins, directions, options, again);
      CHECK(std::equal(hits.begin(), hits.end(), again.begin(), equal));
    }
    const double range = std::isinf(options.max_range) ? -1.0 : options.max_range;
    for (std::size_t i = 0; i != hits.size(); ++i) {
      octomap::point3d end;
      const bool hit = room.theirs.castRay(test::to_octomap(origins[i]), test::to_octomap(directions[i]), end,
                                           options.ignore_unknown, range);
      REQUIRE(static_cast<bool>(hits[i]) == hit);
      for (unsigned axis = 0; axis != 3; ++axis) REQUIRE(static_cast<float>(hits[i].point[axis]) == end(axis));
      REQUIRE(equal(hits[i], room.ours.cast_ray(origins[i], directions[i], options.max_range, options.ignore_unknown)));
    }
    cast_rays(seq, room.ours, origins[0], directions, options, hits);
    REQUIRE(equal(hits[7], room.ours.cast_ray(origins[0], directions[7], options.max_range, options.ignore_unknown)));
  }
}

TEST_CASE("A ray without limit through empty space reaches the end of the grid") {
  occupancy_octree<> map{0.1};
  map.integrate(std::vector<vec3f>{{1.05F, 0.05F, 0.05F}}, vec3f{0.05F, 0.05F, 0.05F});
  const std::vector<vec3f> directions{{-1.0F, 0.0F, 0.0F}, {0.1F, -0.7F, 0.2F}, {-1e-20F, 1.0F, 0.0F}};
  std::vector<ray_hit> hits(3);
  cast_rays(seq, map, vec3f{0.05F, 0.05F, 0.05F}, directions, {.ignore_unknown = true}, hits);
  for (const ray_hit& hit : hits) CHECK(hit.end == ray_end::out_of_grid);
  CHECK(hits[0].key == voxel_key{0, 32768, 32768});
  CHECK(hits[1].key.y == 0);
  CHECK(hits[2].key == voxel_key{32768, 65535, 32768});
}

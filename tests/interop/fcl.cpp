// SPDX-License-Identifier: BSD-3-Clause
//
// Where FCL is installed.
#ifdef ORBIS_TEST_WITH_FCL
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numbers>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/geometric_shape_to_BVH_model.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/math/bv/OBBRSS.h>

#include <orbis/core/random.hpp>
#include <orbis/interop/fcl.hpp>
#include <orbis/octree/occupancy_octree.hpp>
#include <orbis/octree/overlap.hpp>

#include "support/catch.hpp"

using namespace orbis;
using interop::fcl_shape;
using octree::occupancy;

static_assert(octree::overlap_shape<fcl_shape>);

namespace {

using map_type = octree::occupancy_octree<>;

/// Voxels of 0.1 m around the origin that are free, occupied, as likely as not, or unknown.
map_type random_map(random_bits& random) {
  map_type map{0.1};
  for (int i = 0; i != 60; ++i) {
    const auto along = [&] { return 32768 - 12 + random.below(24); };
    map.edit_octant({along(), along(), along()}, [&](octree::block<float>& b) {
      const bool is_whole = random.below(4) == 0;
      const float all = random.below(3) == 0 ? 0.5F : -0.5F;
      for (std::size_t v = 0; v != 64; ++v) {
        const auto what = random.below(24);
        b.known |= std::uint64_t{is_whole || what < 20} << v;
        b.value[v] = is_whole ? all : what == 0 ? 0.5F : what == 1 ? 0.0F : -0.5F;
      }
    });
  }
  return map;
}
vec3 random_place(random_bits& random) {
  const auto along = [&] { return random.uniform() * 3.0 - 1.5; };
  return {along(), along(), along()};
}
se3 random_pose(random_bits& random) {
  const vec3 axis{random.normal(), random.normal(), random.normal()};
  return {so3::exp(vec3{random.uniform() * std::numbers::pi * axis.normalized()}), random_place(random)};
}
/// By FCL alone, box by box: what the shape meets of the voxels around it.
bool meets(const map_type& map, const fcl_shape& shape, occupancy unknown) {
  const octree::bounding_box around = bounds_of(shape);
  const auto keys = octree::keys_between(map.grid(), around.min.array() - 0.1, around.max.array() + 0.1);
  bool found = false;
  for (std::uint32_t z = keys->low.z; z <= keys->high.z; ++z)
    for (std::uint32_t y = keys->low.y; y <= keys->high.y; ++y)
      for (std::uint32_t x = keys->low.x; x <= keys->high.x; ++x) {
        const occupancy state = map.state(octree::voxel_key{x, y, z});
        if (state == occupancy::occupied || (state == occupancy::unknown && unknown == occupancy::occupied))
          found = found || touches(shape, octree::node_cube(map.grid(), {x, y, z}, 0));
      }
  return found;
}
bool collides(const fcl::OcTreed& tree, const fcl_shape& shape) {
  fcl::CollisionResultd result;
  return fcl::collide(&tree, fcl::Transform3d::Identity(), shape.object().collisionGeometry().get(),
                      shape.object().getTransform(), fcl::CollisionRequestd{}, result) != 0;
}

}  // namespace

TEST_CASE("FCL's boxes and balls meet in an octree what our own do") {
  random_bits random{1};
  std::size_t hits = 0;
  for (int round = 0; round != 4; ++round) {
    const map_type map = random_map(random);
    const auto tree = interop::to_fcl(map);
    for (int i = 0; i != 300; ++i) {
      const vec3 p = random_place(random);
      const double r = 0.05 + 0.4 * random.uniform();
      const fcl_shape ball{std::make_shared<fcl::Sphered>(r), se3{so3{}, p}};
      const vec3 half = 0.1 * vec3::Ones() + 0.3 * vec3{random.uniform(), random.uniform(), random.uniform()};
      const fcl_shape box{std::make_shared<fcl::Boxd>(vec3{2.0 * half}), se3{so3{}, p}};
      for (const occupancy unknown : {occupancy::free, occupancy::occupied}) {
        const bool expected = overlaps(map, octree::sphere{p, r}, {.unknown = unknown});
        hits += expected ? 1U : 0U;
        CHECK(overlaps(map, ball, {.unknown = unknown}) == expected);
        CHECK(overlaps(map, box, {.unknown = unknown}) ==
              overlaps(map, octree::bounding_box{p - half, p + half}, {.unknown = unknown}));
      }
      CHECK(collides(*tree, ball) == overlaps(map, octree::sphere{p, r}));
      CHECK(collides(*tree, box) == overlaps(map, octree::bounding_box{p - half, p + half}));
    }
  }
  CHECK(hits > 400);
  CHECK(hits < 2200);
}

TEST_CASE("Any of FCL's geometries at any pose meets what it meets voxel by voxel") {
  random_bits random{2};
  const map_type map = random_map(random);
  const auto tree = interop::to_fcl(map);
  const auto mesh = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  fcl::generateBVHModel(*mesh, fcl::Boxd{0.3, 0.5, 0.2}, fcl::Transform3d::Identity());
  const std::vector<std::shared_ptr<fcl::CollisionGeometryd>> geometries{
      std::make_shared<fcl::Boxd>(0.3, 0.5, 0.2), std::make_shared<fcl::Capsuled>(0.1, 0.5),
      std::make_shared<fcl::Cylinderd>(0.15, 0.4), mesh};
  std::size_t hits = 0, asked = 0;
  for (const auto& geometry : geometries) {
    fcl_shape shape{geometry, se3{}};
    for (int i = 0; i != 100; ++i, ++asked) {
      shape.set_pose(random_pose(random));
      CHECK(bounds_of(shape).min.x() < bounds_of(shape).max.x());
      const bool expected = meets(map, shape, occupancy::free);
      hits += expected ? 1U : 0U;
      CHECK(overlaps(map, shape) == expected);
      CHECK(overlaps(map, shape, {.unknown = occupancy::occupied}) == meets(map, shape, occupancy::occupied));
      CHECK(collides(*tree, shape) == expected);
    }
  }
  CHECK(hits > asked / 10);
  CHECK(hits < asked * 9 / 10);
}
#endif

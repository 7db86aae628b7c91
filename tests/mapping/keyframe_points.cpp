// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <limits>
#include <tuple>
#include <vector>

#include <orbis/camera/cloud.hpp>
#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/mapping/keyframe_points.hpp>
#include <orbis/octree/depth_points.hpp>

#include "mapping/keyframes.hpp"
#include "support/catch.hpp"

using orbis::mapping::keyframe_point_options;
using orbis::mapping::keyframe_points;

namespace {

using seen_point = std::tuple<int, int, double, double, double, float>;

template <class Policy, class Depth>
std::vector<seen_point> read(const Policy& policy, const Depth& depth, const orbis::camera::ray_table& rays,
                             const keyframe_point_options& options, const orbis::se3& pose) {
  keyframe_points reader;
  std::vector<std::vector<seen_point>> parts(reader.parts(rays, options.stride));
  reader.read(policy, depth, rays, options, pose,
              [&](std::size_t part, int x, int y, const orbis::vec3f& p, float range) {
                REQUIRE(part < parts.size());
                parts[part].emplace_back(x, y, p.x(), p.y(), p.z(), range);
              });
  std::vector<seen_point> out;
  for (const auto& part : parts) out.insert(out.end(), part.begin(), part.end());
  return out;
}

}  // namespace

TEST_CASE("a keyframe's points are those of its valid pixels, in their order") {
  const auto scene = orbis::test::wall_scene(2, 100);
  const auto k = scene.keyframe(1);
  const orbis::camera::ray_table rays{scene.camera};
  for (const int stride : {1, 2, 3, 7, 100}) {
    const keyframe_point_options options{.stride = stride, .min_depth = 1.0F, .max_depth = 2.1F};
    const auto seen = read(orbis::seq, k.depth, rays, options, k.T_world_camera);
    CHECK(read(orbis::par.with(3), k.depth, rays, options, k.T_world_camera) == seen);
    std::size_t i = 0;
    for (int y = 0; y < 48; y += stride) {
      for (int x = 0; x < 64; x += stride) {
        const float z = k.depth(x, y);
        if (!(z >= 1.0F && z <= 2.1F)) continue;
        REQUIRE(i < seen.size());
        const auto& [u, v, px, py, pz, range] = seen[i++];
        CHECK(u == x);
        CHECK(v == y);
        const orbis::vec3 p = *scene.camera.unproject({x, y}) * z;
        CHECK((k.T_world_camera * p - orbis::vec3{px, py, pz}).norm() < 1e-6);
        CHECK(range == Approx(p.norm()).epsilon(1e-6));
      }
    }
    CHECK(i == seen.size());
  }
}

TEST_CASE("the points of a keyframe, of an un-projected image and of the octree are the same bits") {
  const auto scene = orbis::test::wall_scene(2, 100);
  const auto k = scene.keyframe(1);
  const auto seen =
      read(orbis::seq, k.depth, orbis::camera::ray_table{scene.camera}, {.max_depth = 100.0F}, k.T_world_camera);
  std::vector<orbis::vec3f> of_keyframe, of_octree;
  for (const auto& s : seen)
    of_keyframe.emplace_back(static_cast<float>(std::get<2>(s)), static_cast<float>(std::get<3>(s)),
                             static_cast<float>(std::get<4>(s)));
  orbis::octree::append_world_points(k.depth, scene.camera, k.T_world_camera, of_octree);
  REQUIRE(of_keyframe.size() > 1000);
  CHECK(of_keyframe == of_octree);
  CHECK(orbis::camera::unproject_depth(orbis::seq, k.depth, scene.camera, {}, k.T_world_camera).points == of_octree);
}

TEST_CASE("pixels without a ray, or a depth that is none, give no points") {
  // So wide that there is nothing in the corners.
  const orbis::camera::kannala_brandt camera{{.width = 64, .height = 48, .fx = 17, .fy = 17, .cx = 31, .cy = 23}, {}};
  const orbis::camera::ray_table rays{camera};
  orbis::image<float> depth(64, 48, 1.0F);
  depth(30, 20) = std::numeric_limits<float>::quiet_NaN();
  depth(31, 20) = std::numeric_limits<float>::infinity();
  depth(32, 20) = -1.0F;
  const auto seen = read(orbis::seq, orbis::camera::depth_view<float>(depth.view()), rays, {}, orbis::se3{});
  std::size_t wanted = 0;
  for (int y = 0; y != 48; ++y) {
    for (int x = 0; x != 64; ++x) wanted += std::isfinite(rays(x, y).x()) ? 1 : 0;
  }
  REQUIRE(wanted < 64 * 48);
  CHECK(seen.size() == wanted - 3);
  for (const auto& s : seen) CHECK(std::isfinite(std::get<2>(s) + std::get<3>(s) + std::get<4>(s)));
}

TEST_CASE("the point of one pixel is the one that the image gives") {
  auto scene = orbis::test::wall_scene(2, 20);
  const auto k = scene.keyframe(1);
  const orbis::camera::ray_table rays{scene.camera};
  const keyframe_point_options options{.min_depth = 1.0F, .max_depth = 2.15F};
  orbis::image<orbis::vec3f> points(64, 48, orbis::vec3f::Zero());
  keyframe_points reader;
  std::size_t all = 0;
  reader.read(orbis::seq, k.depth, rays, options, k.T_world_camera,
              [&](std::size_t, int x, int y, const orbis::vec3f& point, float) {
                points(x, y) = point;
                ++all;
              });
  CHECK(all > 100);
  CHECK(all < 64 * 48);
  const orbis::camera::float_pose pose{k.T_world_camera};
  for (int y = 0; y != 48; ++y)
    for (int x = 0; x != 64; ++x)
      REQUIRE(keyframe_points::point_at(k.depth, x, y, rays, options, pose).value_or(orbis::vec3f::Zero()) ==
              points(x, y));
}

TEST_CASE("a depth image is masked in place as into another one") {
  const auto scene = orbis::test::edge_scene(2);
  const auto k = scene.keyframe(1);
  const orbis::camera::ray_table rays{scene.camera};
  for (const bool flying : {false, true}) {
    keyframe_point_options options{.stride = 3, .min_depth = 1.0F, .max_depth = 2.1F};
    if (flying) options.flying_pixels.emplace();
    keyframe_points reader;
    const auto masked = reader.masked(orbis::seq, k.depth, rays, options);
    // What is left are the pixels that are read.
    options.stride = 1;
    orbis::image<std::uint16_t> expected(64, 48);
    reader.read(orbis::seq, k.depth, rays, options, k.T_world_camera,
                [&](std::size_t, int x, int y, const auto&, float) { expected(x, y) = scene.depth[1](x, y); });
    auto in_place = scene.depth[1];
    reader.mask(orbis::par.with(3), orbis::camera::depth_view<std::uint16_t>(in_place.view(), 1000.0), rays, options,
                in_place.view());
    int removed = 0;
    for (int y = 0; y != 48; ++y)
      for (int x = 0; x != 64; ++x) {
        REQUIRE(masked(x, y) == expected(x, y));
        REQUIRE(in_place(x, y) == expected(x, y));
        removed += scene.depth[1](x, y) != 0 && expected(x, y) == 0 ? 1 : 0;
      }
    CHECK(removed > 0);
  }
}

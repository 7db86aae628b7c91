// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/mapping/dense_cloud.hpp>

#include "mapping/keyframes.hpp"
#include "support/catch.hpp"

using orbis::mapping::dense_cloud;

TEST_CASE("every valid depth becomes a coloured point in the world") {
  const auto scene = orbis::test::wall_scene(1);
  const orbis::camera::ray_table rays{scene.camera};
  dense_cloud dense{rays, {.stride = 1}};
  const auto k = scene.keyframe(0);
  const std::size_t measured = dense.splice(orbis::seq, k);
  CHECK(measured == dense.size());
  const orbis::point_cloud cloud = dense.cloud();
  std::size_t i = 0;
  for (int y = 0; y != scene.camera.height(); ++y) {
    for (int x = 0; x != scene.camera.width(); ++x) {
      const float z = k.depth(x, y);
      if (z == 0 || z > 4) continue;
      const orbis::vec3 p = k.T_world_camera * (*scene.camera.unproject({x, y}) * z);
      REQUIRE(i < cloud.size());
      CHECK((cloud.points[i].cast<double>() - p).norm() < 1e-5);
      CHECK(cloud.colors[i] == k.color(x, y));
      CHECK(dense.ranges()[i] == Approx((p - k.T_world_camera.translation()).norm()).epsilon(1e-5));
      ++i;
    }
  }
  CHECK(i == cloud.size());
}

TEST_CASE("with a voxel size the cloud follows the surface and not the frames") {
  const auto scene = orbis::test::wall_scene(1);
  const orbis::camera::ray_table rays{scene.camera};
  dense_cloud dense{rays, {.stride = 1, .voxel_size = 0.05}};
  for (int again = 0; again != 5; ++again) dense.splice(orbis::par, scene.keyframe(0));
  dense_cloud once{rays, {.stride = 1, .voxel_size = 0.05}};
  once.splice(orbis::seq, scene.keyframe(0));
  CHECK(dense.size() == once.size());
  const auto all_points = dense.cloud().points;
  const auto once_points = once.cloud().points;
  for (std::size_t i = 0; i != once.size(); ++i) {
    CHECK((all_points[i] - once_points[i]).norm() < 1e-5F);
  }
}

TEST_CASE("a keyframe's measurements are those whose point of the cloud is kept") {
  const auto scene = orbis::test::wall_scene(3);
  const orbis::camera::ray_table rays{scene.camera};
  for (const double voxel : {0.0, 0.04}) {
    dense_cloud dense{rays, {.stride = 2, .voxel_size = voxel}};
    std::size_t measured = 0;
    for (std::size_t i = 0; i != 3; ++i) measured += dense.splice(orbis::par.with(2), scene.keyframe(i));
    const std::vector<char> all(dense.size(), 1);
    const std::vector<char> none(dense.size(), 0);
    std::vector<char> half(dense.size(), 0);
    const orbis::point_cloud cloud = dense.cloud();
    for (std::size_t i = 0; i != half.size(); ++i) half[i] = cloud.points[i].x() < 0;
    std::size_t found = 0;
    for (std::size_t i = 0; i != 3; ++i) {
      const auto every = dense.measurements(orbis::seq, scene.keyframe(i), i);
      CHECK(dense.measurements(orbis::seq, scene.keyframe(i), i, all) == every);
      CHECK(dense.measurements(orbis::seq, scene.keyframe(i), i, none).empty());
      for (const auto& p : dense.measurements(orbis::seq, scene.keyframe(i), i, half)) CHECK(p.x() < 0.04F);
      found += every.size();
    }
    CHECK(found == measured);
  }
}

TEST_CASE("without colour images the cloud has no colours") {
  const auto scene = orbis::test::wall_scene(2);
  dense_cloud dense{orbis::camera::ray_table{scene.camera}};
  auto k = scene.keyframe(0);
  dense.splice(orbis::seq, k);
  CHECK(dense.cloud().has_colors());
  k.color = {};
  dense.splice(orbis::seq, k);
  CHECK_FALSE(dense.cloud().has_colors());
}

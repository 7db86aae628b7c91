// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <orbis/slam/detail/map/point_observation.hpp>

#include "slam/ring_world.hpp"
#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("An observation has the pixel, the depth as disparity, and the information of its level") {
  test::ring_world world;
  slam::frame f = world.look(3, world.truth(3));
  const vec3 point(1, 2, 3);
  const auto o = slam::detail::make_observation(world.rig, f, 5, point);
  CHECK(o.point == point);
  CHECK(o.pixel == f.pixel(5));
  CHECK(o.has_depth());
  CHECK(o.right == Approx(f.pixel(5).x() - 400.0 / static_cast<double>(f.depth[5])));
  CHECK(o.information == world.rig.scales.information(f.features.keypoints[5].octave));
  f.depth[5] = 0.0F;
  CHECK_FALSE(slam::detail::make_observation(world.rig, f, 5, point).has_depth());
}

TEST_CASE("A keypoint agrees with the point that it observes, and with no other one") {
  test::ring_world world;
  const slam::frame f = world.look(3, world.truth(3));
  const se3 T_camera_world = world.truth(3).inverse();
  std::size_t right = 0, wrong = 0;
  for (std::uint32_t i = 0; i < f.size(); ++i) {
    const std::uint32_t other = (i + 1) % static_cast<std::uint32_t>(f.size());
    right += slam::detail::agrees(world.rig, f, T_camera_world, i, world.point(world.point_of(3U, i)));
    wrong += slam::detail::agrees(world.rig, f, T_camera_world, i, world.point(world.point_of(3U, other)));
  }
  REQUIRE(f.size() > 50);
  CHECK(right > f.size() * 9 / 10);
  CHECK(wrong < f.size() / 20);
  CHECK(slam::detail::error_limit(true) > slam::detail::error_limit(false));
}

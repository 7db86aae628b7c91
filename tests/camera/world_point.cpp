// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/camera/world_point.hpp>

#include "support/catch.hpp"

using orbis::se3;
using orbis::vec3;
using orbis::vec6;
using orbis::camera::float_pose;
using orbis::camera::world_point;

TEST_CASE("a pixel's point lies where its ray and its depth put it") {
  const se3 T_world_camera = se3::exp((vec6() << 1.0, -2.0, 0.5, 0.3, -0.7, 2.0).finished());
  const float_pose pose{T_world_camera};
  for (const float x : {-0.6F, 0.0F, 0.25F})
    for (const float y : {-0.4F, 0.1F})
      for (const float z : {0.3F, 1.0F, 4.0F}) {
        const auto p = world_point(pose, x, y, z);
        const vec3 exact = T_world_camera * vec3(double{x} * z, double{y} * z, z);
        CHECK((vec3(p[0], p[1], p[2]) - exact).norm() < 2e-6);
      }
}

TEST_CASE("without a pose a point has its coordinates in the camera frame") {
  const auto p = world_point(float_pose{se3{}}, 0.5F, -0.25F, 3.0F);
  CHECK(p == std::array<float, 3>{1.5F, -0.75F, 3.0F});
}

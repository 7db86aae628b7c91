// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/frame.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("A keypoint with depth observes a point of the camera frame, and of the world") {
  slam::frame f;
  f.T_world_camera = se3(so3::exp(vec3(0.0, 0.0, 0.5)), vec3(1.0, 2.0, 3.0));
  f.features.keypoints = {{.x = 12.0F, .y = 30.0F}, {.x = 7.0F, .y = 8.0F}};
  f.features.descriptors.resize(2);
  f.depth = {2.0F, 0.0F};
  f.rays = {vec3(0.25, -0.5, 1.0), vec3(0.0, 0.0, 1.0)};
  CHECK(f.size() == 2);
  CHECK(f.has_depth(0));
  CHECK_FALSE(f.has_depth(1));
  CHECK(f.point_camera(0) == vec3(0.5, -1.0, 2.0));
  CHECK(f.point_world(0) == f.T_world_camera * vec3(0.5, -1.0, 2.0));
  CHECK(f.pixel(1) == vec2(7.0, 8.0));
}

TEST_CASE("A keyframe is a frame with an id, which refers to nothing at first") {
  const slam::keyframe k;
  CHECK(k.id == slam::no_id);
  CHECK(k.size() == 0);
}

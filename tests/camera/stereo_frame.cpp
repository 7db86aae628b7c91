// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/camera/stereo_frame.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("a stereo frame owns its pixels") {
  camera::stereo_frame frame;
  CHECK_FALSE(frame.T_world_camera);
  frame.right = image<rgb8>{3, 2, rgb8{1, 2, 3}};
  frame.T_world_camera = se3{so3{}, vec3{1.0, 2.0, 3.0}};
  const camera::stereo_frame copy = frame;
  frame.right(0, 0) = rgb8{};
  frame.T_world_camera.reset();
  CHECK(copy.right(0, 0) == rgb8{1, 2, 3});
  CHECK(copy.T_world_camera->translation().z() == 3.0);
}

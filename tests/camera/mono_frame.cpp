// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/camera/mono_frame.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("a monocular frame owns its pixels") {
  camera::mono_frame frame;
  CHECK_FALSE(frame.T_world_camera);
  frame.color = image<rgb8>{3, 2, rgb8{1, 2, 3}};
  frame.T_world_camera = se3{so3{}, vec3{1.0, 2.0, 3.0}};
  const camera::mono_frame copy = frame;
  frame.color(0, 0) = rgb8{};
  frame.T_world_camera.reset();
  CHECK(copy.color(0, 0) == rgb8{1, 2, 3});
  CHECK(copy.T_world_camera->translation().z() == 3.0);
}

// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>

#include <orbis/camera/rgbd_frame.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("a frame shows its depth in metres") {
  camera::rgbd_frame frame;
  frame.depth = image<std::uint16_t>{2, 2, 2500};
  CHECK(frame.depth_metres()(1, 1) == 2.5F);
  frame.depth_scale = 5000.0;
  CHECK(frame.depth_metres()(1, 1) == 0.5F);
  CHECK(!frame.T_world_camera);
}

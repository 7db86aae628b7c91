// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/core/trajectory.hpp>

#include "support/catch.hpp"

TEST_CASE("a stamped pose begins at the origin and takes points of the camera to the world") {
  orbis::trajectory t(1);
  CHECK(t[0].timestamp == 0.0);
  CHECK(t[0].T_world_camera.to_matrix() == orbis::mat4::Identity());
  t.push_back({.timestamp = 2.5, .T_world_camera = {orbis::so3{}, {1, 2, 3}}});
  CHECK(t[1].T_world_camera * orbis::vec3{0, 0, 1} == orbis::vec3{1, 2, 4});
}

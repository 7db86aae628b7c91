// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/camera/settings.hpp>

#include "support/catch.hpp"

TEST_CASE("settings default to millimetres and thirty frames per second") {
  const orbis::camera::camera_settings s{.model = orbis::camera::pinhole{640, 480, 525, 525, 319.5, 239.5}};
  CHECK(s.depth_scale == 1000.0);
  CHECK(s.fps == 30.0);
  CHECK(!s.baseline);
}

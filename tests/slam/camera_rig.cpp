// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <orbis/camera/pinhole.hpp>
#include <orbis/slam/camera_rig.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("A rig has the settings of the system") {
  slam::options o;
  o.bf = 250.0;
  o.features.levels = 6;
  o.features.scale_factor = 1.5F;
  o.min_depth = 0.3;
  o.max_depth = 5.0;
  const auto rig = slam::make_rig(camera::pinhole{640, 480, 525.0, 525.0, 320.0, 240.0}, o);
  CHECK(rig.camera().width() == 640);
  CHECK(rig.model.bf == 250.0);
  CHECK(rig.scales.levels() == 6);
  CHECK(rig.scales.factor() == 1.5);
  CHECK(rig.min_depth == 0.3);
  CHECK(rig.max_depth == 5.0);
}

TEST_CASE("The deviation of depth grows with its square, and with the pyramid level") {
  const slam::camera_rig<camera::pinhole> rig{{{640, 480, 525.0, 525.0, 320.0, 240.0}, 400.0}};
  CHECK(rig.depth_deviation(2.0, 0) == Approx(0.01));
  CHECK(rig.depth_deviation(4.0, 0) == Approx(0.04));
  CHECK(rig.depth_deviation(2.0, 3) == Approx(0.01 * 1.2 * 1.2 * 1.2));
}

// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <numbers>

#include <orbis/slam/landmark_patch.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("a patch turns with the world and is scaled with it, and does not shift") {
  slam::landmark_patch patch;
  patch.across = {0.01, 0.0, 0.0};
  patch.down = {0.0, 0.02, 0.0};
  const so3 quarter = so3::exp(vec3{0.0, 0.0, 0.5 * std::numbers::pi});
  patch.move(sim3{quarter, vec3{5.0, 6.0, 7.0}, 2.0});
  CHECK((patch.across - vec3{0.0, 0.02, 0.0}).norm() < 1e-15);
  CHECK((patch.down - vec3{-0.04, 0.0, 0.0}).norm() < 1e-15);
  CHECK(patch.pixels == nullptr);
}

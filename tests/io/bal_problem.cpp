// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <limits>

#include <orbis/io/bal_problem.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("The projection of the format looks along the negative z axis and is distorted radially") {
  std::array<double, 9> camera{0, 0, 0, 0, 0, 0, 400, 0, 0};
  CHECK(io::project_bal(camera, vec3(1, 2, -4)).value().isApprox(vec2(100, 200)));
  camera[7] = 0.5;
  camera[8] = -2.0;
  const double r2 = 5.0 / 16.0;
  CHECK(io::project_bal(camera, vec3(1, 2, -4)).value().isApprox((1 + 0.5 * r2 - 2 * r2 * r2) * vec2(100, 200)));
  // A quarter turn about z takes x to y; then a shift.
  camera = {0, 0, std::acos(0.0), 0, 0, -1, 400, 0, 0};
  CHECK(io::project_bal(camera, vec3(1, 0, -3)).value().isApprox(vec2(0, 100), 1e-12));
  CHECK_FALSE(io::project_bal(camera, vec3(1, 0, 1)).has_value());
  CHECK_FALSE(io::project_bal(camera, vec3(std::numeric_limits<double>::quiet_NaN(), 0, -3)).has_value());
}

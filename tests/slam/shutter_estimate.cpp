// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <orbis/slam/shutter_estimate.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("without frames nothing is known of a shutter, and a global one is assumed") {
  const slam::shutter_estimate none;
  CHECK(none.shutter.is_global());
  CHECK(std::isinf(none.read_out_deviation));
  CHECK(std::isinf(none.delay_deviation));
}

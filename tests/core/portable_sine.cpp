// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <numbers>

#include <orbis/core/portable_sine.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("the sine of turns agrees with the library's") {
  for (int i = -4000; i <= 4000; ++i) {
    const double turns = i * 0.00137;
    CHECK(std::abs(sin_turns(turns) - std::sin(2.0 * std::numbers::pi * turns)) < 1e-13);
    CHECK(std::abs(cos_turns(turns) - std::cos(2.0 * std::numbers::pi * turns)) < 1e-13);
  }
  CHECK(sin_turns(0.0) == 0.0);
}

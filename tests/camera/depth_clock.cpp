// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>
#include <optional>

#include <orbis/camera/depth_clock.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("A slow drift of the depth camera's clock is followed through the noise of polling") {
  camera::depth_clock clock;
  double farthest = 0.0;
  for (int i = 0; i != 300; ++i) {
    const double true_difference = -0.008 + 0.015 * i / 300.0;
    const double polled = 0.004 * std::round((true_difference + 0.001 * std::sin(2.0 * i)) / 0.004);
    const double smoothed = clock.update(i, i + polled);
    if (i > 30) farthest = std::max(farthest, std::abs(smoothed - true_difference));
  }
  CHECK(farthest < 0.003);
}

TEST_CASE("A jump to the depth image of the next interval is taken over at once") {
  camera::depth_clock clock;
  for (int i = 0; i != 50; ++i) CHECK(clock.update(i, i + 0.016) == Approx(0.016));
  CHECK(clock.update(50.0, 49.983) == Approx(-0.017));
  for (int i = 0; i != 50; ++i) CHECK(clock.update(i, i + 0.005) == Approx(0.005));
  CHECK(clock.update(50.0, 50.0 - 0.0061) == Approx(-0.0061));  // at 90 frames per second
}

TEST_CASE("Differences that do not matter are none, and stamps that are missing or absurd change nothing") {
  camera::depth_clock clock;
  CHECK(clock.update(1.0, std::nullopt) == 0.0);
  CHECK(clock.update(1.0, 1.0) == 0.0);
  CHECK(clock.update(1.0, 1.0001) == 0.0);
  CHECK(clock.update(1.0, 1.02) == Approx(0.02));
  CHECK(clock.update(1.0, std::nullopt) == Approx(0.02));
  CHECK(clock.update(1.0, 6.0) == Approx(0.02));
  CHECK(clock.update(1.0, std::numeric_limits<double>::quiet_NaN()) == Approx(0.02));
  CHECK(clock.update(1.0, 1.02) == Approx(0.02));
}

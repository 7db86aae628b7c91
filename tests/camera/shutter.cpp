// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <orbis/camera/shutter.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("Rows are read one after the other around the time of the frame") {
  constexpr camera::shutter s{.color_read_out = 0.03, .depth_read_out = 0.02, .depth_delay = 0.005};
  CHECK(std::abs(s.color_time(-0.5, 480) + 0.015) < 1e-15);
  CHECK(std::abs(s.color_time(239.5, 480)) < 1e-15);
  CHECK(std::abs(s.color_time(479.5, 480) - 0.015) < 1e-15);
  CHECK(std::abs(s.color_time(101.0, 480) - s.color_time(100.0, 480) - 0.03 / 480.0) < 1e-15);
  CHECK(std::abs(s.depth_time(-0.5, 480) + 0.005) < 1e-15);
  CHECK(std::abs(s.depth_time(239.5, 480) - 0.005) < 1e-15);
}

TEST_CASE("A shutter is global if both images are of one time") {
  CHECK(camera::shutter{}.is_global());
  CHECK_FALSE(camera::shutter{.color_read_out = 0.03}.is_global());
  CHECK_FALSE(camera::shutter{.depth_read_out = 0.03}.is_global());
  CHECK_FALSE(camera::shutter{.depth_delay = -0.01}.is_global());
}

TEST_CASE("A depth image is of its frame's time, or comes before or after it") {
  CHECK(camera::shutter{}.is_depth_simultaneous());
  CHECK(camera::shutter{.color_read_out = 0.03, .depth_read_out = 0.03}.is_depth_simultaneous());
  CHECK_FALSE(camera::shutter{.color_read_out = 0.03}.is_depth_simultaneous());
  CHECK_FALSE(camera::shutter{.depth_delay = 0.01}.is_depth_simultaneous());
  CHECK(camera::shutter{.depth_delay = -0.01}.is_depth_early());
  CHECK_FALSE(camera::shutter{.depth_delay = 0.01}.is_depth_early());
  CHECK_FALSE(camera::shutter{.color_read_out = 0.03}.is_depth_early());
}

// SPDX-License-Identifier: BSD-3-Clause
#include <limits>

#include <orbis/camera/intrinsics.hpp>

#include "support/catch.hpp"

TEST_CASE("intrinsics that no camera can have are told") {
  using orbis::camera::intrinsics;
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  CHECK(is_valid(intrinsics{}));
  CHECK(is_valid(intrinsics{640, 480, 525, 525, 319.5, 239.5}));
  CHECK(is_valid(intrinsics{640, 480, 525, 525, -10, 1000}));
  for (const intrinsics& k : {intrinsics{-1, 480, 525, 525, 0, 0}, intrinsics{640, -1, 525, 525, 0, 0},
                              intrinsics{640, 480, 0, 525, 0, 0}, intrinsics{640, 480, 525, -525, 0, 0},
                              intrinsics{640, 480, nan, 525, 0, 0}, intrinsics{640, 480, 525, inf, 0, 0},
                              intrinsics{640, 480, 525, 525, nan, 0}, intrinsics{640, 480, 525, 525, 0, inf}})
    CHECK(!is_valid(k));
}

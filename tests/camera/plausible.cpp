// SPDX-License-Identifier: BSD-3-Clause
#include <limits>
#include <string>
#include <utility>

#include <orbis/camera/plausible.hpp>

#include "support/catch.hpp"

using namespace orbis;
using camera::intrinsics;

TEST_CASE("cameras that exist are plausible") {
  for (const intrinsics& k :
       {intrinsics{640, 480, 525, 525, 319.5, 239.5}, intrinsics{1226, 370, 707.09, 707.09, 601.9, 183.1},
        intrinsics{640, 480, 150, 150, 320, 240},        // a fisheye lens
        intrinsics{160, 120, 40000, 40000, 80, 60},      // a telescope
        intrinsics{64, 64, 1000, 1000, -900, 1300},      // the corner of a larger image
        intrinsics{640, 240, 525, 262.5, 319.5, 119.5},  // every other row
        intrinsics{0, 0, 525, 525, 319.5, 239.5}})       // of unknown size
    CHECK(camera::plausible(k, "here"));
}

TEST_CASE("cameras that cannot be are refused, with the parameter and the reason") {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const auto& [k, why] : {std::pair{intrinsics{160, 120, 0.000001, 0.000001, 80, 60}, "fx = 1e-06 is too short"},
                               std::pair{intrinsics{160, 120, 130, 0, 80, 60}, "fy = 0 is not a focal length"},
                               std::pair{intrinsics{160, 120, -3, 130, 80, 60}, "fx = -3 is not a focal length"},
                               std::pair{intrinsics{160, 120, nan, 130, 80, 60}, "fx = nan is not a focal length"},
                               std::pair{intrinsics{0, 0, 130, inf, 80, 60}, "fy = inf is not a focal length"},
                               std::pair{intrinsics{160, 120, 7.9, 7.9, 80, 60}, "fx = 7.9 is too short"},
                               std::pair{intrinsics{120, 160, 8.0, 7.9, 60, 80}, "fy = 7.9 is too short"},
                               std::pair{intrinsics{160, 120, 1e6, 1e6, 80, 60}, "fx = 1e+06 is too long"},
                               std::pair{intrinsics{160, 120, 130, 20, 80, 60}, "fy = 20 differs from fx"},
                               std::pair{intrinsics{160, 120, 130, 130, nan, 60}, "cx = nan is not a coordinate"},
                               std::pair{intrinsics{160, 120, 130, 130, 80, 1e10}, "cy = 1e+10 is not a coordinate"},
                               std::pair{intrinsics{160, 120, 130, 130, 1400, 60}, "cx = 1400 is too far"},
                               std::pair{intrinsics{160, 120, 130, 130, 80, -1200}, "cy = -1200 is too far"},
                               std::pair{intrinsics{-1, 120, 130, 130, 80, 60}, "size = -1 is negative"}}) {
    INFO(why);
    const auto checked = camera::plausible(k, "calib.txt");
    REQUIRE_FALSE(checked);
    CHECK(checked.error().code == errc::malformed);
    CHECK(checked.error().where == "calib.txt");
    CHECK(checked.error().message.starts_with(why));
  }
}

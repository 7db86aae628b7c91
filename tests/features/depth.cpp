// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <limits>

#include <orbis/features/depth.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;

TEST_CASE("depth at a keypoint on a plane is the depth of the plane") {
  image<std::uint16_t> depth(20, 20, 2000);
  const camera::depth_view<std::uint16_t> view{depth.view(), 1000.0};
  const auto d = depth_at(view, 7.4F, 9.6F);
  REQUIRE(d);
  CHECK(d->z == Approx(2.0));
  CHECK(d->sigma == Approx(0.0012 + 0.0019 * 4.0));
  CHECK(depth_at(view, -0.4F, 19.4F));
  CHECK_FALSE(depth_at(view, -0.6F, 5.0F));
  CHECK_FALSE(depth_at(view, 5.0F, 19.6F));
  CHECK_FALSE(depth_at(view, std::numeric_limits<float>::quiet_NaN(), 5.0F));
}

TEST_CASE("a steep slope is no depth edge and gives its middle") {
  image<float> depth(9, 9);
  for (int y = 0; y != 9; ++y)
    for (int x = 0; x != 9; ++x) depth(x, y) = 1.0F + 0.01F * static_cast<float>(x);
  const auto d = depth_at(camera::depth_view<float>{depth.view()}, 4, 4, {.radius = 2});
  REQUIRE(d);
  CHECK(d->z == Approx(1.04));
}

TEST_CASE("a window across a depth edge gives no depth and one with a stray does") {
  image<float> depth(9, 9, 1.0F);
  for (int y = 0; y != 9; ++y)
    for (int x = 5; x != 9; ++x) depth(x, y) = 2.0F;
  const camera::depth_view<float> view{depth.view()};
  CHECK_FALSE(depth_at(view, 4, 4));
  CHECK_FALSE(depth_at(view, 5, 4));
  CHECK(depth_at(view, 3, 4)->z == Approx(1.0));
  CHECK(depth_at(view, 6, 4)->z == Approx(2.0));
  depth(2, 4) = 0.5F;  // a flying pixel, at the keypoint itself
  CHECK(depth_at(view, 2, 4)->z == Approx(1.0));
}

TEST_CASE("invalid depths around a keypoint do not count") {
  image<float> depth(5, 5, std::numeric_limits<float>::quiet_NaN());
  const camera::depth_view<float> view{depth.view()};
  CHECK_FALSE(depth_at(view, 2, 2));
  depth(1, 1) = 1.0F;
  depth(2, 1) = 1.01F;
  CHECK_FALSE(depth_at(view, 2, 2));
  depth(3, 3) = 1.002F;
  REQUIRE(depth_at(view, 2, 2));
  CHECK(depth_at(view, 2, 2)->z == Approx(1.002));
  CHECK_FALSE(depth_at(camera::depth_view<float>{}, 0, 0));
}

TEST_CASE("the virtual right column is that of a camera a baseline to the right") {
  const double f = 525.0, cx = 320.0, baseline = 0.08, x = 0.3, z = 2.5;
  const double left = f * x / z + cx;
  const double right = f * (x - baseline) / z + cx;
  CHECK(virtual_right(left, z, f * baseline) == Approx(right));
}

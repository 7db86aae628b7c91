// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <limits>
#include <type_traits>

#include <orbis/camera/depth.hpp>

#include "support/catch.hpp"

using namespace orbis;
using camera::depth_view;

static_assert(camera::depth_source<depth_view<std::uint16_t>> && camera::depth_source<depth_view<float>>);

TEST_CASE("stored depth becomes metres and 0 and 65535 become nothing") {
  image<std::uint16_t> stored{5, 1};
  stored(0, 0) = 0;
  stored(1, 0) = 1;
  stored(2, 0) = 5000;
  stored(3, 0) = 65534;
  stored(4, 0) = 65535;
  const depth_view<std::uint16_t> tum{stored, 5000.0};
  CHECK(tum(0, 0) == 0.0F);
  CHECK(tum(1, 0) == 0.0002F);
  CHECK(tum(2, 0) == 1.0F);
  CHECK(tum(3, 0) == 13.1068F);
  CHECK(tum(4, 0) == 0.0F);
  CHECK(depth_view<std::uint16_t>{stored, 1000.0}(2, 0) == 5.0F);
}

TEST_CASE("float depth that is no distance becomes nothing") {
  const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  const float values[] = {nan, inf, -inf, 0.0F, -0.0F, -1.0F, 2.5F};
  const depth_view<float> depth{image_view<const float>{values, 7, 1}};
  for (int x = 0; x != 6; ++x) CHECK(depth(x, 0) == 0.0F);
  CHECK(depth(6, 0) == 2.5F);
}

TEST_CASE("the limits of the range belong to it and ranges can only be narrowed") {
  const float values[] = {0.49F, 0.5F, 2.0F, 4.0F, 4.01F};
  const depth_view<float> depth{image_view<const float>{values, 5, 1}, 1.0, 0.5F, 4.0F};
  CHECK(depth(0, 0) == 0.0F);
  CHECK(depth(1, 0) == 0.5F);
  CHECK(depth(3, 0) == 4.0F);
  CHECK(depth(4, 0) == 0.0F);
  const auto narrow = depth.within(1.0F, 10.0F);
  CHECK(narrow(1, 0) == 0.0F);
  CHECK(narrow(2, 0) == 2.0F);
  CHECK(narrow(4, 0) == 0.0F);
}

TEST_CASE("a depth view knows its number type from the image it is made of") {
  using orbis::camera::depth_view;
  const orbis::image<float> metres(2, 1, 1.5F);
  orbis::image<std::uint16_t> millimetres(2, 1, 1500);
  static_assert(std::is_same_v<decltype(depth_view{metres}), depth_view<float>>);
  static_assert(std::is_same_v<decltype(depth_view{millimetres.view(), 1000.0}), depth_view<std::uint16_t>>);
  CHECK(depth_view{metres}(1, 0) == 1.5F);
  CHECK(depth_view{millimetres.view(), 1000.0}(1, 0) == 1.5F);
}

// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include <orbis/core/random.hpp>
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

namespace {

/// A plane seen by a pinhole camera: 1 / z is linear in the pixel.
image<float> plane_image(double z, double du, double dv) {
  image<float> depth(41, 41);
  for (int y = 0; y != 41; ++y)
    for (int x = 0; x != 41; ++x) depth(x, y) = static_cast<float>(1.0 / (1.0 / z + du * (x - 20) + dv * (y - 20)));
  return depth;
}

}  // namespace

TEST_CASE("depth on a slanted plane is that at the keypoint, between the pixels, and less certain") {
  const double du = 0.002, dv = -0.001;  // 8 mm a pixel at 2 m
  const auto depth = plane_image(2.0, du, dv);
  const camera::depth_view<float> view{depth.view()};
  const auto truth = [&](double x, double y) { return 1.0 / (0.5 + du * (x - 20.0) + dv * (y - 20.0)); };
  for (const int radius : {1, 2, 3})
    for (const float x : {20.0F, 20.3F, 19.51F})
      for (const float y : {20.0F, 20.49F, 19.8F}) {
        const auto d = depth_at(view, x, y, {.radius = radius});
        REQUIRE(d);
        CHECK(std::abs(d->z - truth(double{x}, double{y})) < 0.0006);  // its curvature: a pixel is 9 mm
        CHECK(d->sigma > std::hypot(depth_noise{}(d->z), 0.5 * 0.0085));
        CHECK(d->sigma < std::hypot(depth_noise{}(d->z), 0.5 * 0.0095) + 0.001);
      }
}

TEST_CASE("a hole on one side of a slope does not pull the depth to the other") {
  auto depth = plane_image(2.0, 0.003, 0.0);
  for (int y = 0; y != 41; ++y) depth(21, y) = 0.0F;
  const camera::depth_view<float> view{depth.view()};
  const auto d = depth_at(view, 20.0F, 20.0F);
  REQUIRE(d);
  CHECK(d->z == Approx(2.0).margin(0.0005));  // a median of what is left says 2.006
  // Beyond what is valid it does not guess.
  depth(20, 19) = depth(20, 20) = depth(20, 21) = 0.0F;
  const auto edge = depth_at(view, 20.4F, 20.0F, {.radius = 2});
  REQUIRE(edge);
  CHECK(edge->z <= 2.04);
  CHECK(edge->z >= 1.95);
}

TEST_CASE("the deviation says how far the depth is off, under the sensor's noise") {
  random_bits random{11};
  const auto clean = plane_image(1.5, 0.001, 0.0015);
  double squared = 0.0;
  int count = 0;
  for (int trial = 0; trial != 2000; ++trial) {
    auto depth = clean;
    for (int y = 17; y <= 23; ++y)
      for (int x = 17; x <= 23; ++x) {
        double normal = -6.0;
        for (int i = 0; i != 12; ++i) normal += random.uniform(0.0, 1.0);
        depth(x, y) += static_cast<float>(depth_noise{}(1.5) * normal);
      }
    // The keypoint itself is half a pixel off.
    const double off = random.uniform(-0.8, 0.8);
    const auto d = depth_at(camera::depth_view<float>{depth.view()}, static_cast<float>(20.0 + off), 20.0F);
    if (!d) continue;
    ++count;
    squared += (d->z - 1.5) * (d->z - 1.5) / (d->sigma * d->sigma);
  }
  CHECK(count > 1900);
  const double ratio = std::sqrt(squared / count);
  INFO("error / sigma " << ratio);
  CHECK(ratio < 1.0);
  CHECK(ratio > 0.2);
}

TEST_CASE("positions halfway between pixels are rounded away from zero") {
  image<float> depth(9, 9);
  for (int y = 0; y != 9; ++y)
    for (int x = 0; x != 9; ++x) depth(x, y) = 1.0F + 0.001F * static_cast<float>(x);
  const camera::depth_view<float> view{depth.view()};
  const auto pixel = [&](float x) { return depth_at(view, x, 4.0F, {.radius = 0, .min_valid = 1}).value().z; };
  CHECK(pixel(0.49999997F) == Approx(1.0));
  CHECK(pixel(-0.49999997F) == Approx(1.0));
  CHECK(pixel(0.5F) == Approx(1.001));
  CHECK(pixel(3.4999998F) == Approx(1.003));
  CHECK(pixel(3.5F) == Approx(1.004));
}

TEST_CASE("a few depths without an edge give their median") {
  image<float> depth(5, 5);
  depth(1, 1) = 1.004F;
  depth(3, 2) = 1.0F;
  depth(2, 3) = 1.001F;
  const auto d = depth_at(camera::depth_view<float>{depth.view()}, 2.0F, 2.0F);
  REQUIRE(d);
  CHECK(d->z == Approx(1.001));
}

namespace {

/// A depth source whose pixels are no image.
struct own_depth {
  [[nodiscard]] static int width() { return 7; }
  [[nodiscard]] static int height() { return 5; }
  [[nodiscard]] float operator()(int, int) const { return 1.0F; }
  [[nodiscard]] static std::span<const float> pixels() { return {}; }
};
static_assert(camera::depth_source<own_depth>);

}  // namespace

TEST_CASE("the pixels of a depth can be fetched at any position, also outside the image") {
  constexpr float infinite = std::numeric_limits<float>::infinity(), unknown = std::numeric_limits<float>::quiet_NaN();
  const image<std::uint16_t> one_pixel(1, 1, std::uint16_t{1000}), empty, large(7, 5, std::uint16_t{1000});
  for (const auto* pixels : {&one_pixel, &empty, &large})
    for (const float x : {-infinite, -1.0F, -0.5F, 0.0F, 0.5F, 6.4F, 7.0F, infinite, unknown})
      for (const float y : {-infinite, -1.0F, 0.0F, 1.0F, 3.9F, 4.0F, 5.0F, infinite, unknown})
        features::prefetch_depth(camera::depth_view{*pixels, 1000.0}, x, y);
  features::prefetch_depth(own_depth{}, 3.0F, 2.0F);
  CHECK(depth_at(camera::depth_view{large, 1000.0}, 3.0F, 2.0F).value().z == Approx(1.0));
}

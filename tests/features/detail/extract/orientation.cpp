// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include <orbis/features/detail/extract/orientation.hpp>

#include "features/images.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;
using namespace orbis::features::detail;

TEST_CASE("moments are the sums of the definition, at every level") {
  // The disc's rows as the ORB paper's authors published them.
  constexpr int half_widths[16] = {15, 15, 15, 15, 14, 14, 14, 13, 13, 12, 11, 10, 9, 8, 6, 3};
  for (const auto& im : {test::noise(33, 32, 1), test::blocks(33, 32, 2), image<std::uint8_t>(33, 32, 255)}) {
    image_moments expected;
    for (int dy = -15; dy <= 15; ++dy)
      for (int dx = -half_widths[std::abs(dy)]; dx <= half_widths[std::abs(dy)]; ++dx) {
        expected.x += dx * im(16 + dx, 15 + dy);
        expected.y += dy * im(16 + dx, 15 + dy);
      }
    const std::uint8_t* centre = &im(16, 15);
    for (const auto level : simd::available_levels()) {
      const simd::level_limit limit{level};
      CHECK(simd::kernel<disc_moments_kernel, disc_moments_kernel::signature>()(centre, 33) == expected);
    }
  }
}

TEST_CASE("the extremes of moments do not overflow") {
  for (int side = 0; side != 4; ++side) {
    image<std::uint8_t> im(40, 40, 0);
    for (int y = 0; y != 40; ++y)
      for (int x = 0; x != 40; ++x) {
        const bool bright = side == 0 ? x > 20 : side == 1 ? y > 20 : side == 2 ? x < 20 : y < 20;
        if (bright) im(x, y) = 255;
      }
    for (const auto level : simd::available_levels()) {
      const simd::level_limit limit{level};
      CHECK(intensity_centroid{}(im, 20, 20).angle == Approx(side * std::numbers::pi / 2).margin(1e-6));
    }
  }
}

TEST_CASE("an angle is that of the standard library, from 0 to below 2 pi") {
  const double pi = std::numbers::pi;
  for (int i = 0; i != 10000; ++i) {
    const double wanted = 2.0 * pi * i / 10000.0;
    for (const double radius : {1e-3, 1.0, 1e6}) {
      const float angle = polar_angle(radius * std::cos(wanted), radius * std::sin(wanted));
      CHECK((angle >= 0.0F && angle < 2.0F * std::numbers::pi_v<float>));
      CHECK(std::abs(std::remainder(static_cast<double>(angle) - wanted, 2.0 * pi)) < 5e-7);
    }
  }
  CHECK(polar_angle(0.0, 0.0) == 0.0F);
  CHECK(polar_angle(5.0, 0.0) == 0.0F);
  CHECK(polar_angle(5.0, -1e-12) < 6.3F);
}

TEST_CASE("a turned picture is turned, and a plain one points to the right") {
  const auto im = test::blocks(81, 81, 3);
  image<std::uint8_t> quarter(81, 81);  // by 90 degrees, clockwise as one looks at it
  for (int y = 0; y != 81; ++y)
    for (int x = 0; x != 81; ++x) quarter(80 - y, x) = im(x, y);
  const orientation a = intensity_centroid{}(im, 40, 40);
  const orientation b = intensity_centroid{}(quarter, 40, 40);
  CHECK(std::remainder(b.angle - a.angle - std::numbers::pi_v<float> / 2, 2.0F * std::numbers::pi_v<float>) ==
        Approx(0.0).margin(1e-5));
  CHECK(a.cosine == Approx(std::cos(a.angle)).margin(1e-6));
  CHECK(a.sine == Approx(std::sin(a.angle)).margin(1e-6));
  const orientation none = intensity_centroid{}(image<std::uint8_t>(40, 40, 9), 20, 20);
  CHECK((none.angle == 0.0F && none.cosine == 1.0F && none.sine == 0.0F));
}

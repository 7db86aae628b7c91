// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/slam/monocular.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

using descriptor = features::binary_descriptor<256>;
static_assert(slam::sensor<slam::monocular, descriptor>);
static_assert(slam::measures<slam::monocular, camera::pinhole, features::orb_extractor, image_view<const rgb8>>);
static_assert(
    slam::measures<slam::monocular, camera::pinhole, features::orb_extractor, image_view<const std::uint8_t>>);
static_assert(!slam::measures<slam::monocular, camera::pinhole, features::orb_extractor, image_view<const rgb8>,
                              camera::depth_view<float>>);

}  // namespace

TEST_CASE("One image gives features with rays, none with depth, in colour as in grey") {
  image<std::uint8_t> grey(320, 240);
  for (int y = 0; y != 240; ++y)
    for (int x = 0; x != 320; ++x)
      grey(x, y) = static_cast<std::uint8_t>(20 + mix64(static_cast<std::uint64_t>(y / 11 * 1000 + x / 11)) % 200);
  image<rgb8> color(320, 240);
  for (std::size_t i = 0; i != grey.pixels().size(); ++i)
    color.pixels()[i] = {grey.pixels()[i], grey.pixels()[i], grey.pixels()[i]};
  const slam::camera_rig<camera::pinhole> rig{{camera::pinhole{320, 240, 260.0, 260.0, 160.0, 120.0}, 40.0}};
  const features::orb_extractor extract;
  const auto f = slam::monocular::measure(rig, extract, std::as_const(color).view());
  const auto g = slam::monocular::measure(rig, extract, std::as_const(grey).view());
  REQUIRE(f.size() > 200);
  CHECK(f.sensor == slam::sensor_kind::monocular);
  for (std::size_t i = 0; i != f.size(); ++i) {
    CHECK_FALSE(f.has_depth(i));
    CHECK(std::abs(f.rays[i].x() - (f.pixel(i).x() - 160.0) / 260.0) < 1e-9);
    CHECK(f.landmarks[i] == slam::no_id);
  }
  CHECK(g.features.descriptors == f.features.descriptors);
  CHECK(slam::monocular::begins_map(f, {}) == f.size());
  CHECK(slam::monocular::begins_map(f, {.min_start_points = 100000}) == 0);
}

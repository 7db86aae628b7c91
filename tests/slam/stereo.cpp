// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/slam/stereo.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

using descriptor = features::binary_descriptor<256>;
static_assert(slam::sensor<slam::stereo, descriptor>);
using rig_type = slam::camera_rig<camera::pinhole>;
static_assert(slam::measures<slam::stereo, camera::pinhole, features::orb_extractor, image_view<const rgb8>,
                             image_view<const rgb8>>);
static_assert(slam::measures<slam::stereo, camera::pinhole, features::orb_extractor, image_view<const std::uint8_t>,
                             image_view<const std::uint8_t>>);
static_assert(!slam::measures<slam::stereo, camera::pinhole, features::orb_extractor, image_view<const rgb8>,
                              camera::depth_view<float>>);
static_assert(!slam::measures<slam::rgbd, camera::pinhole, features::orb_extractor, image_view<const rgb8>,
                              image_view<const rgb8>>);

/// Blocks of random brightness.
image<std::uint8_t> blocks(int width, int height) {
  image<std::uint8_t> im(width, height);
  for (int y = 0; y != height; ++y)
    for (int x = 0; x != width; ++x)
      im(x, y) = static_cast<std::uint8_t>(20 + mix64(static_cast<std::uint64_t>(y / 11 * 1000 + x / 11)) % 200);
  return im;
}

/// The image `by` pixels to the left: what a right camera sees of a wall.
image<std::uint8_t> shifted(const image<std::uint8_t>& from, int by) {
  image<std::uint8_t> to(from.width(), from.height());
  for (int y = 0; y != to.height(); ++y)
    for (int x = 0; x != to.width(); ++x) to(x, y) = from(std::min(x + by, from.width() - 1), y);
  return to;
}

image<rgb8> colored(const image<std::uint8_t>& grey) {
  image<rgb8> to(grey.width(), grey.height());
  for (std::size_t i = 0; i != grey.pixels().size(); ++i)
    to.pixels()[i] = {grey.pixels()[i], grey.pixels()[i], grey.pixels()[i]};
  return to;
}

rig_type rig_of(double focal, double baseline) {
  return slam::make_rig(camera::pinhole{400, 300, focal, focal, 200.0, 150.0}, slam::stereo_options(focal, baseline));
}

}  // namespace

TEST_CASE("A stereo sensor measures the depth of features by their disparity") {
  const auto left = blocks(400, 300), right = shifted(left, 20);
  const slam::stereo sensor;
  const rig_type rig = rig_of(300.0, 0.2);  // 60 pixel metres: 3 m
  const auto f = sensor.measure(rig, features::orb_extractor{}, left.view(), right.view());
  REQUIRE(f.size() > 300);
  REQUIRE(f.depth.size() == f.size());
  CHECK(f.landmarks == std::vector<slam::landmark_id>(f.size()));
  std::size_t with_depth = 0, wrong = 0;
  for (std::size_t i = 0; i != f.size(); ++i) {
    CHECK((*rig.camera().project(f.rays[i]) - f.pixel(i)).norm() < 1e-9);
    if (!f.has_depth(i)) continue;
    ++with_depth;
    const double right_column = rig.model.right(f.pixel(i).x(), static_cast<double>(f.depth[i]));
    wrong += std::abs(f.pixel(i).x() - 20.0 - right_column) > 1.0;
  }
  CHECK(with_depth > f.size() * 7 / 10);
  CHECK(wrong < with_depth / 50);
  SECTION("the same in colour") {
    const auto c = sensor.measure(rig, features::orb_extractor{}, colored(left).view(), colored(right).view());
    CHECK(c.features == f.features);
    CHECK(c.depth == f.depth);
  }
  SECTION("features without a right coordinate have no depth, and begin no map") {
    const image<std::uint8_t> blank(400, 300, 90);
    const auto alone = sensor.measure(rig, features::orb_extractor{}, left.view(), blank.view());
    CHECK(alone.features == f.features);
    CHECK(std::all_of(alone.depth.begin(), alone.depth.end(), [](float z) { return z == 0.0F; }));
    CHECK(slam::stereo::begins_map(alone, slam::options{}) == 0);
    CHECK(slam::stereo::begins_map(f, slam::options{}) == with_depth);
  }
  SECTION("depth out of range is not used") {
    rig_type near = rig;
    near.max_depth = 2.0;
    const auto none = sensor.measure(near, features::orb_extractor{}, left.view(), right.view());
    CHECK(std::count_if(none.depth.begin(), none.depth.end(), [](float z) { return z > 2.001F; }) == 0);
    rig_type far = rig;
    far.min_depth = 4.0;
    const auto later = sensor.measure(far, features::orb_extractor{}, left.view(), right.view());
    CHECK(std::count_if(later.depth.begin(), later.depth.end(), [](float z) { return z > 0.0F && z < 3.999F; }) == 0);
  }
}

TEST_CASE("The options of a stereo camera follow from its focal length and its baseline") {
  const slam::options o = slam::stereo_options(707.0, 0.54, {.min_inliers = 33});
  CHECK(o.bf == 707.0 * 0.54);
  CHECK(o.min_depth == 0.54);
  CHECK(o.max_depth == o.bf);  // a disparity of a pixel
  CHECK(o.close_depth == 40.0 * 0.54);
  CHECK(o.min_inliers == 33);
  CHECK(slam::stereo_options(20.0, 0.1).close_depth == 2.0);  // not farther than what is measured at all
}

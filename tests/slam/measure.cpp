// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/slam/measure.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

using rig_type = slam::camera_rig<camera::pinhole>;

/// Three keypoints at fixed places.
struct three_points {
  features::features operator()(image_view<const rgb8>) const {
    features::features f;
    for (const float x : {10.0F, 20.0F, 30.0F}) f.keypoints.push_back({.x = x, .y = 12.0F});
    f.descriptors.resize(3);
    return f;
  }
};

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

TEST_CASE("An RGB-D sensor measures the depth of each feature, within the range of the rig") {
  const slam::camera_rig<camera::pinhole> rig{{{40, 30, 35.0, 35.0, 20.0, 15.0}, 400.0}, {}, 0.5, 4.0};
  const image<rgb8> color(40, 30);
  image<float> depth(40, 30, 2.0F);
  for (int y = 8; y < 17; ++y)
    for (int x = 16; x < 25; ++x) depth(x, y) = 9.0F;  // too far
  const auto f = slam::measure_rgbd(rig, three_points{}, color.view(), camera::depth_view<float>{depth.view()});
  REQUIRE(f.size() == 3);
  CHECK(f.depth == std::vector<float>{2.0F, 0.0F, 2.0F});
  CHECK(f.landmarks == std::vector<slam::landmark_id>(3));
  for (std::size_t i = 0; i != 3; ++i) {
    CHECK(f.rays[i].z() == 1.0);
    CHECK((*rig.camera().project(f.rays[i]) - f.pixel(i)).norm() < 1e-9);
  }
  CHECK((f.point_camera(0) - 2.0 * f.rays[0]).norm() < 1e-12);
}

TEST_CASE("A frame begins a map if enough of its features have depth") {
  slam::frame f;
  f.features.keypoints.resize(5);
  f.features.descriptors.resize(5);
  f.depth = {1.0F, 0.0F, 2.0F, 3.0F, 0.0F};
  slam::options o;
  o.min_start_points = 3;
  CHECK(slam::start_points(f, o) == 3);
  o.min_start_points = 4;
  CHECK(slam::start_points(f, o) == 0);
  o.min_start_points = 0;
  f.depth.assign(5, 0.0F);
  CHECK(slam::start_points(f, o) == 0);
  o.scale_is_measured = false;
  CHECK(slam::start_points(f, o) == 5);
  o.min_start_points = 6;
  CHECK(slam::start_points(f, o) == 0);
}

TEST_CASE("The depth of a keypoint is read where the camera sees the same point later") {
  const slam::camera_rig<camera::pinhole> rig{{{40, 30, 35.0, 35.0, 20.0, 15.0}, 400.0}, {}, 0.5, 4.0};
  const image<rgb8> color(40, 30);
  // A slope, seen by a camera that moves to the right: the depth image, taken later, sees it further to the left.
  image<float> depth(40, 30);
  for (int y = 0; y != 30; ++y)
    for (int x = 0; x != 40; ++x) depth(x, y) = 2.0F + 0.02F * static_cast<float>(x);
  const camera::depth_view<float> view{depth.view()};
  auto f = slam::measure_rgbd(rig, three_points{}, color.view(), view);
  slam::detail::keep_as_read(f);
  vec6 moving = vec6::Zero();
  moving[0] = 2.0;
  slam::follow_rows(rig, {{.depth_delay = 0.02}, moving}, f.as_read, view);
  for (std::size_t i = 0; i != 3; ++i) {
    CHECK(f.as_read[i].stored_depth == f.depth[i]);
    const double shift = 35.0 * 0.04 / static_cast<double>(f.depth[i]);  // pixels to the left
    CHECK(static_cast<double>(f.depth[i] - f.as_read[i].depth) == Approx(0.02 * shift).epsilon(0.05));
  }
  // Many keypoints, some without depth, are read as one by one.
  std::vector<slam::keypoint_as_read> many;
  for (int i = 0; i != 100; ++i) {
    many.push_back(f.as_read[static_cast<std::size_t>(i % 3)]);
    many.back().x += 0.01F * static_cast<float>(i);
    many.back().ray_x += 0.0003 * i;
    if (i % 7 == 0) many.back().stored_depth = 0.0F;
  }
  std::vector<slam::keypoint_as_read> each = many;
  const slam::frame_motion later{{.depth_delay = 0.02}, moving};
  slam::follow_rows(rig, later, many, view);
  for (std::size_t i = 0; i != each.size(); ++i) {
    slam::follow_rows(rig, later, std::span{each}.subspan(i, 1), view);
    CHECK(many[i].depth == each[i].depth);
  }
  // With rows of both images at one time there is nothing to follow.
  slam::detail::keep_as_read(f);
  slam::follow_rows(rig, {{.color_read_out = 0.03, .depth_read_out = 0.03}, moving}, f.as_read, view);
  for (std::size_t i = 0; i != 3; ++i) CHECK(f.as_read[i].depth == f.depth[i]);
}

TEST_CASE("Depth that may belong to another surface later is not used") {
  const slam::camera_rig<camera::pinhole> rig{{{40, 30, 35.0, 35.0, 20.0, 15.0}, 400.0}, {}, 0.5, 4.0};
  const image<rgb8> color(40, 30);
  image<float> depth(40, 30, 2.0F);
  for (int y = 0; y != 30; ++y)
    for (int x = 0; x != 18; ++x) depth(x, y) = 3.0F;
  const camera::depth_view<float> view{depth.view()};
  auto f = slam::measure_rgbd(rig, three_points{}, color.view(), view);
  REQUIRE(f.has_depth(1));
  slam::detail::keep_as_read(f);
  vec6 moving = vec6::Zero();
  moving[0] = 5.0;
  slam::follow_rows(rig, {{.depth_delay = 0.03}, moving}, f.as_read, view);
  CHECK(f.as_read[1].depth == 0.0F);
  CHECK(f.as_read[1].stored_depth == 2.0F);
  CHECK(f.as_read[2].depth == 2.0F);
}

TEST_CASE("A stereo sensor measures the depth of features by their disparity") {
  const auto left = blocks(400, 300), right = shifted(left, 20);
  slam::stereo_memory memory;
  const rig_type rig = rig_of(300.0, 0.2);  // 60 pixel metres: 3 m
  const auto f = slam::measure_stereo(rig, features::orb_extractor{}, left.view(), right.view(), memory);
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
    const auto c =
        slam::measure_stereo(rig, features::orb_extractor{}, colored(left).view(), colored(right).view(), memory);
    CHECK(c.features == f.features);
    CHECK(c.depth == f.depth);
  }
  SECTION("features without a right coordinate have no depth, and begin no map") {
    const image<std::uint8_t> blank(400, 300, 90);
    const auto alone = slam::measure_stereo(rig, features::orb_extractor{}, left.view(), blank.view(), memory);
    CHECK(alone.features == f.features);
    CHECK(std::all_of(alone.depth.begin(), alone.depth.end(), [](float z) { return z == 0.0F; }));
    CHECK(slam::start_points(alone, slam::options{}) == 0);
    CHECK(slam::start_points(f, slam::options{}) == with_depth);
  }
  SECTION("depth out of range is not used") {
    rig_type near = rig;
    near.max_depth = 2.0;
    const auto none = slam::measure_stereo(near, features::orb_extractor{}, left.view(), right.view(), memory);
    CHECK(std::count_if(none.depth.begin(), none.depth.end(), [](float z) { return z > 2.001F; }) == 0);
    rig_type far = rig;
    far.min_depth = 4.0;
    const auto later = slam::measure_stereo(far, features::orb_extractor{}, left.view(), right.view(), memory);
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
  const auto f = slam::measure_monocular(rig, extract, std::as_const(color).view());
  const auto g = slam::measure_monocular(rig, extract, std::as_const(grey).view());
  REQUIRE(f.size() > 200);
  CHECK(f.sensor == slam::sensor_kind::monocular);
  for (std::size_t i = 0; i != f.size(); ++i) {
    CHECK_FALSE(f.has_depth(i));
    CHECK(std::abs(f.rays[i].x() - (f.pixel(i).x() - 160.0) / 260.0) < 1e-9);
    CHECK(f.landmarks[i] == slam::no_id);
  }
  CHECK(g.features.descriptors == f.features.descriptors);
  CHECK(slam::start_points(f, slam::monocular_options()) == f.size());
  CHECK(slam::start_points(f, {.min_start_points = 100000, .scale_is_measured = false}) == 0);
}

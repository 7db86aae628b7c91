// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/image.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/slam/sensor.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

using descriptor = features::binary_descriptor<256>;
static_assert(slam::sensor<slam::rgbd, descriptor>);

/// Three keypoints at fixed places.
struct three_points {
  features::features operator()(image_view<const rgb8>) const {
    features::features f;
    for (const float x : {10.0F, 20.0F, 30.0F}) f.keypoints.push_back({.x = x, .y = 12.0F});
    f.descriptors.resize(3);
    return f;
  }
};

}  // namespace

TEST_CASE("An RGB-D sensor measures the depth of each feature, within the range of the rig") {
  const slam::camera_rig<camera::pinhole> rig{{{40, 30, 35.0, 35.0, 20.0, 15.0}, 400.0}, {}, 0.5, 4.0};
  const image<rgb8> color(40, 30);
  image<float> depth(40, 30, 2.0F);
  for (int y = 8; y < 17; ++y)
    for (int x = 16; x < 25; ++x) depth(x, y) = 9.0F;  // too far
  const auto f = slam::rgbd::measure(rig, three_points{}, color.view(), camera::depth_view<float>{depth.view()});
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
  CHECK(slam::rgbd::begins_map(f, o) == 3);
  o.min_start_points = 4;
  CHECK(slam::rgbd::begins_map(f, o) == 0);
  o.min_start_points = 0;
  f.depth.assign(5, 0.0F);
  CHECK(slam::rgbd::begins_map(f, o) == 0);
}

TEST_CASE("The depth of a keypoint is read where the camera sees the same point later") {
  const slam::camera_rig<camera::pinhole> rig{{{40, 30, 35.0, 35.0, 20.0, 15.0}, 400.0}, {}, 0.5, 4.0};
  const image<rgb8> color(40, 30);
  // A slope, seen by a camera that moves to the right: the depth image, taken later, sees it further to the left.
  image<float> depth(40, 30);
  for (int y = 0; y != 30; ++y)
    for (int x = 0; x != 40; ++x) depth(x, y) = 2.0F + 0.02F * static_cast<float>(x);
  const camera::depth_view<float> view{depth.view()};
  auto f = slam::rgbd::measure(rig, three_points{}, color.view(), view);
  slam::detail::keep_as_read(f);
  vec6 moving = vec6::Zero();
  moving[0] = 2.0;
  slam::rgbd::follow_rows(rig, {{.depth_delay = 0.02}, moving}, f, color.view(), view);
  for (std::size_t i = 0; i != 3; ++i) {
    CHECK(f.as_read[i].stored_depth == f.depth[i]);
    const double shift = 35.0 * 0.04 / static_cast<double>(f.depth[i]);  // pixels to the left
    CHECK(static_cast<double>(f.depth[i] - f.as_read[i].depth) == Approx(0.02 * shift).epsilon(0.05));
  }
  // With rows of both images at one time there is nothing to follow.
  slam::detail::keep_as_read(f);
  slam::rgbd::follow_rows(rig, {{.color_read_out = 0.03, .depth_read_out = 0.03}, moving}, f, color.view(), view);
  for (std::size_t i = 0; i != 3; ++i) CHECK(f.as_read[i].depth == f.depth[i]);
}

TEST_CASE("Depth that may belong to another surface later is not used") {
  const slam::camera_rig<camera::pinhole> rig{{{40, 30, 35.0, 35.0, 20.0, 15.0}, 400.0}, {}, 0.5, 4.0};
  const image<rgb8> color(40, 30);
  image<float> depth(40, 30, 2.0F);
  for (int y = 0; y != 30; ++y)
    for (int x = 0; x != 18; ++x) depth(x, y) = 3.0F;
  const camera::depth_view<float> view{depth.view()};
  auto f = slam::rgbd::measure(rig, three_points{}, color.view(), view);
  REQUIRE(f.has_depth(1));
  slam::detail::keep_as_read(f);
  vec6 moving = vec6::Zero();
  moving[0] = 5.0;
  slam::rgbd::follow_rows(rig, {{.depth_delay = 0.03}, moving}, f, color.view(), view);
  CHECK(f.as_read[1].depth == 0.0F);
  CHECK(f.as_read[1].stored_depth == 2.0F);
  CHECK(f.as_read[2].depth == 2.0F);
}

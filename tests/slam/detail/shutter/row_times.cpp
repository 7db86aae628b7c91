// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/slam/detail/shutter/row_times.hpp>

#include "support/catch.hpp"

using namespace orbis;
using slam::detail::keep_as_read;
using slam::detail::move_to_frame_time;
using slam::detail::moved_by;

namespace {

vec6 hand_motion() {
  vec6 twist;
  twist << 0.3, -0.5, 0.2, 0.8, -1.1, 0.6;
  return twist;
}

const slam::camera_rig<camera::pinhole> rig{{{640, 480, 525.0, 525.0, 319.5, 239.5}, 400.0}, {}, 0.1, 10.0};

/// A frame that sees points in the camera frame of its time, each in its row's time, while the camera moves.
slam::frame seen_while_moving(const std::vector<vec3>& points, const camera::shutter& shutter, const vec6& twist) {
  slam::frame f;
  for (const vec3& p : points) {
    vec3 then = p;
    for (int k = 0; k != 20; ++k) {  // the row decides on the time, which decides on the row
      const double v = rig.camera().project(then)->y();
      then = se3::exp(-shutter.color_time(v, 480) * twist) * p;
    }
    const vec2 at = *rig.camera().project(then);
    f.features.keypoints.push_back({.x = static_cast<float>(at.x()), .y = static_cast<float>(at.y())});
    f.rays.push_back(then / then.z());
    f.depth.push_back(static_cast<float>(then.z()));
  }
  f.features.descriptors.resize(points.size());
  f.landmarks.assign(points.size(), slam::no_id);
  return f;
}

std::vector<vec3> some_points(std::size_t n) {
  std::vector<vec3> all;
  random_bits random{7};
  for (std::size_t i = 0; i != n; ++i) {
    const double z = random.uniform(0.6, 4.0);
    all.emplace_back(z * random.uniform(-0.5, 0.5), z * random.uniform(-0.4, 0.4), z);
  }
  return all;
}

}  // namespace

TEST_CASE("A point moves by the exponential of a twist, to second order") {
  const vec3 p(0.4, -0.3, 2.0);
  for (const double t : {-0.02, 0.0, 0.015}) {
    const vec3 exact = se3::exp(t * hand_motion()) * p;
    CHECK((moved_by(hand_motion(), t, p) - exact).norm() < 1e-5);  // a thousandth of a pixel is 4e-6 of 2 m
    CHECK((moved_by(hand_motion(), -t, moved_by(hand_motion(), t, p)) - p).norm() < 2e-5);
  }
}

TEST_CASE("Keypoints of a rolling shutter are moved to where a global one sees them") {
  const camera::shutter shutter{.color_read_out = 0.03};
  const auto points = some_points(60);
  slam::frame f = seen_while_moving(points, shutter, hand_motion());
  const slam::frame read = f;
  keep_as_read(f);
  move_to_frame_time(f, rig, shutter, hand_motion());
  double most = 0.0;
  for (std::size_t i = 0; i != f.size(); ++i) {
    most = std::max(most, (read.pixel(i) - *rig.camera().project(points[i])).norm());
    CHECK((f.pixel(i) - *rig.camera().project(points[i])).norm() < 0.005);
    CHECK((f.point_camera(i) - points[i]).norm() < 1e-4);
    CHECK(f.rays[i].z() == 1.0);
  }
  CHECK(most > 5.0);  // what it would be without
  CHECK(f.twist == hand_motion());

  // Again, from where they were read: by no motion they are there.
  move_to_frame_time(f, rig, shutter, vec6::Zero());
  for (std::size_t i = 0; i != f.size(); ++i) {
    CHECK((f.pixel(i) - read.pixel(i)).norm() < 1e-4);
    CHECK(f.depth[i] == read.depth[i]);
  }
}

TEST_CASE("A keypoint without depth is moved by what is known of its depth, or by the rotation alone") {
  const camera::shutter shutter{.color_read_out = 0.03};
  const auto points = some_points(40);
  slam::frame f = seen_while_moving(points, shutter, hand_motion());
  f.depth.assign(f.size(), 0.0F);
  keep_as_read(f);
  move_to_frame_time(f, rig, shutter, hand_motion(), [&](std::size_t i) { return points[i].z(); });
  for (std::size_t i = 0; i != f.size(); ++i) {
    CHECK_FALSE(f.has_depth(i));
    CHECK((f.pixel(i) - *rig.camera().project(points[i])).norm() < 0.1);
  }
  vec6 turning = hand_motion();
  turning.head<3>().setZero();
  slam::frame turned = seen_while_moving(points, shutter, turning);
  turned.depth.assign(turned.size(), 0.0F);
  keep_as_read(turned);
  move_to_frame_time(turned, rig, shutter, turning);
  for (std::size_t i = 0; i != turned.size(); ++i)
    CHECK((turned.pixel(i) - *rig.camera().project(points[i])).norm() < 0.005);
}

TEST_CASE("A frame whose keypoints were not kept is left alone") {
  const auto points = some_points(5);
  slam::frame f = seen_while_moving(points, {}, hand_motion());
  const slam::frame before = f;
  move_to_frame_time(f, rig, {.color_read_out = 0.03}, hand_motion());
  for (std::size_t i = 0; i != f.size(); ++i) CHECK(f.pixel(i) == before.pixel(i));
  CHECK(f.twist == vec6::Zero());
}

TEST_CASE("A keypoint without a ray stays where it was read") {
  slam::frame f = seen_while_moving(some_points(2), {}, hand_motion());
  f.rays[1].setConstant(std::numeric_limits<double>::quiet_NaN());
  f.depth[1] = 0.0F;
  const vec2 there = f.pixel(1);
  keep_as_read(f);
  move_to_frame_time(f, rig, {.color_read_out = 0.03}, hand_motion());
  CHECK(f.pixel(1) == there);
  CHECK(std::isnan(f.rays[1].x()));
}

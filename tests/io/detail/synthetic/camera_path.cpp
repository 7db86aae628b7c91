// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include <orbis/io/detail/synthetic/arithmetic.hpp>
#include <orbis/io/detail/synthetic/camera_path.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::io::detail::synthetic;

TEST_CASE("floors and smooth noise are right on both sides of zero") {
  CHECK(floor_of(1.5) == 1);
  CHECK(floor_of(-1.5) == -2);
  CHECK(floor_of(-2.0) == -2);
  for (int i = -200; i != 200; ++i) {
    const double a = smooth_noise(3, 4, 0.05 * i), b = smooth_noise(3, 4, 0.05 * (i + 1));
    CHECK(std::abs(a) <= 1.0);
    CHECK(std::abs(a - b) < 0.25);  // continuous: the steepest slope is 15 / 8 * 2 for each unit
  }
}

TEST_CASE("the columns of a pose are the rotation its quaternion stands for") {
  const camera_path path{{}, 5, 12.0};
  for (int i = 0; i != 60; ++i) {
    const camera_pose pose = path.at(0.2 * i);
    const mat3 r = pose.T_world_camera().rotation_matrix();
    CHECK((r.col(0) - to_vec3(pose.right)).norm() < 1e-14);
    CHECK((r.col(1) - to_vec3(pose.down)).norm() < 1e-14);
    CHECK((r.col(2) - to_vec3(pose.forward)).norm() < 1e-14);
    CHECK(pose.down.z < -0.8);  // the camera is held upright
  }
}

TEST_CASE("the path is walked at the speed of a hand and closes its loop") {
  constexpr int frames = 400;
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    const camera_path path{{}, seed, frames / 30.0};
    std::array<bool, 36> looked{};
    for (int i = 0; i != frames; ++i) {
      const camera_pose pose = path.at(i / 30.0);
      const double yaw = std::atan2(pose.forward.y, pose.forward.x) / (2.0 * std::numbers::pi);
      looked[static_cast<std::size_t>((yaw - std::floor(yaw)) * 36.0) % 36] = true;
      if (i == 0) continue;
      const se3 step = path.at((i - 1) / 30.0).T_world_camera().inverse() * pose.T_world_camera();
      CHECK(step.translation().norm() * 30.0 < 0.6);
      CHECK(step.rotation().angle() * 30.0 < 65.0 * std::numbers::pi / 180.0);
    }
    for (const bool seen : looked) CHECK(seen);
    const se3 first = path.at(0.0).T_world_camera();
    for (const int i : {frames - 1, frames - 10, frames - 18}) {
      const se3 apart = first.inverse() * path.at(i / 30.0).T_world_camera();
      CHECK(apart.translation().norm() < 0.04);
      CHECK(apart.rotation().angle() < 0.05);
    }
  }
}

TEST_CASE("without wobble and jitter the path is a level ellipse") {
  const camera_path path{
      {.semi_axis_x = 0.9, .semi_axis_y = 0.5, .height = 1.2, .pitch = 0.0, .wobble = 0.0, .jitter = 0.0}, 9, 10.0};
  for (int i = 0; i != 50; ++i) {
    const camera_pose pose = path.at(0.2 * i);
    CHECK(square(pose.position.x / 0.9) + square(pose.position.y / 0.5) == Approx(1.0));
    CHECK(pose.position.z == 1.2);
    CHECK(std::abs(pose.forward.z) < 1e-14);
  }
  CHECK((to_vec3(path.at(0.0).position) - to_vec3(path.at(9.9).position)).norm() < 1e-12);
}

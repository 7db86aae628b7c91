// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include <orbis/io/detail/synthetic/arithmetic.hpp>
#include <orbis/io/detail/synthetic/camera_path.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::io::detail::synthetic;
using orbis::io::synthetic_path_options;

TEST_CASE("floors and smooth noise are right on both sides of zero") {
  CHECK(floor_to_int(1.5) == 1);
  CHECK(floor_to_int(-1.5) == -2);
  CHECK(floor_to_int(-2.0) == -2);
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

namespace {

/// Heights, and slopes of the optical axis and of the rows of the image, 200 times a second while the camera walks.
struct measured_gait {
  static constexpr double rate = 200.0, start = 2.0, end = 18.0;  // Hz, seconds
  std::vector<double> height, pitch, roll;

  explicit measured_gait(const io::synthetic_gait_options& gait) {
    const camera_path path{{.pitch = 0.0, .wobble = 0.0, .jitter = 0.0, .gait = gait}, 3, 22.0};
    for (double t = start; t < end; t += 1.0 / rate) {
      const camera_pose pose = path.at(t);
      height.push_back(pose.position.z - 1.35);
      pitch.push_back(std::asin(pose.forward.z));
      roll.push_back(std::asin(-pose.right.z));
    }
  }
};

/// Amplitude of the part with this frequency (Hz), which makes whole oscillations in the time.
double amplitude(const std::vector<double>& values, double frequency) {
  double c = 0.0, s = 0.0;
  for (std::size_t i = 0; i != values.size(); ++i) {
    c += values[i] * cos_turns(frequency * static_cast<double>(i) / measured_gait::rate);
    s += values[i] * sin_turns(frequency * static_cast<double>(i) / measured_gait::rate);
  }
  return 2.0 * std::hypot(c, s) / static_cast<double>(values.size());
}

}  // namespace

TEST_CASE("A gait lifts and pitches the camera once per step, and rolls it once per two steps") {
  const measured_gait walk{
      {.step_rate = 2.5, .bounce = 0.01, .pitch = 0.012, .roll = 0.02, .impact = 0.0, .impact_angle = 0.0}};
  CHECK(amplitude(walk.height, 2.5) == Approx(0.01).epsilon(0.01));
  CHECK(amplitude(walk.pitch, 2.5) == Approx(0.012).epsilon(0.01));
  CHECK(amplitude(walk.roll, 1.25) == Approx(0.02).epsilon(0.01));
  CHECK(amplitude(walk.height, 1.25) < 1e-4);
  CHECK(amplitude(walk.roll, 2.5) < 1e-3);
  const auto still = measured_gait{{}};
  for (const double z : still.height) REQUIRE(z == 0.0);
}

TEST_CASE("Every step of a gait has an impact whose vibration decays before the next one") {
  const measured_gait walk{
      {.step_rate = 2.5, .bounce = 0.0, .pitch = 0.0, .roll = 0.0, .impact = 0.002, .impact_duration = 0.2}};
  std::size_t impacts = 0, at_rest = 0;
  double largest = 0.0, smallest = 1.0, peak = 0.0;
  for (std::size_t i = 0; i != walk.height.size(); ++i) {
    const double z = std::abs(walk.height[i]);
    at_rest += z == 0.0 ? 1U : 0U;
    peak = std::max(peak, z);
    if (z != 0.0 || peak == 0.0) continue;
    if (++impacts > 1) {  // the first one may have begun before
      largest = std::max(largest, peak);
      smallest = std::min(smallest, peak);
    }
    peak = 0.0;
  }
  CHECK((impacts >= 39 && impacts <= 41));  // 16 s
  CHECK(std::abs(static_cast<double>(at_rest) - 0.5 * static_cast<double>(walk.height.size())) < 50.0);
  CHECK(largest < 1.5 * 0.002);
  CHECK(smallest > 0.5 * 0.7 * 0.002);
  CHECK(largest > 1.5 * smallest);
  CHECK(amplitude(walk.pitch, 17.5) > 1e-4);  // the seventh multiple of the step rate, the impacts having 17 Hz
}

TEST_CASE("A camera that rests at the ends of its path does not walk there") {
  const synthetic_path_options standing{}, walking{.gait = {.step_rate = 2.0}};
  const camera_path without{standing, 3, 12.0}, with{walking, 3, 12.0};
  for (const double t : {-0.01, 0.0, 11.5, 12.0})
    CHECK((to_vec3(with.at(t).position) - to_vec3(without.at(t).position)).norm() == 0.0);
  CHECK((to_vec3(with.at(5.1).position) - to_vec3(without.at(5.1).position)).norm() > 1e-4);
}

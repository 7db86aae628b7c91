// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <numbers>

#include <orbis/eval/rpe.hpp>

#include "support/catch.hpp"

namespace eval = orbis::eval;
using orbis::se3;
using orbis::so3;
using orbis::vec3;

namespace {

orbis::trajectory curve(int n) {
  orbis::trajectory poses;
  for (int i = 0; i != n; ++i)
    poses.push_back({0.1 * i, se3(so3::exp(vec3(0.02 * i, 0, 0.01 * i)), vec3(std::sin(0.1 * i), 0.05 * i, 0))});
  return poses;
}

}  // namespace

TEST_CASE("a constant drift shows as what it is for every delta") {
  const auto reference = curve(50);
  // Every step goes 2 mm too far and turns 0.5 degrees too much, about its own z axis.
  const se3 drift(so3::exp(vec3(0, 0, 0.5 * std::numbers::pi / 180.0)), vec3(0, 0, 0.002));
  orbis::trajectory estimate{reference[0]};
  estimate[0].T_world_camera = se3(so3::exp(vec3(3, 2, 1)), vec3(7, 8, 9));
  for (std::size_t i = 1; i != reference.size(); ++i) {
    const se3 step = reference[i - 1].T_world_camera.inverse() * reference[i].T_world_camera;
    estimate.push_back({reference[i].timestamp, estimate.back().T_world_camera * step * drift});
  }
  const auto error = eval::rpe(estimate, reference).value();
  CHECK(error.translation.count == 49);
  CHECK(error.translation.rmse == Approx(0.002));
  CHECK(error.translation.median == Approx(0.002));
  CHECK(error.rotation.rmse == Approx(0.5));
  CHECK(eval::rpe(reference, reference, {.delta_frames = 7}).value().rotation.max < 1e-5);
  const auto frames = eval::rpe(estimate, reference, {.delta_frames = 10}).value();
  const auto seconds = eval::rpe(estimate, reference, {.delta_seconds = 1.0}).value();
  CHECK(frames.translation.count == 40);
  CHECK(seconds.translation.count >= 40);  // near the end, the last pose may serve twice
  CHECK(seconds.rotation.median == Approx(frames.rotation.median).epsilon(0.05));
}

TEST_CASE("motions across a gap are left out of a delta in seconds") {
  auto reference = curve(40);
  for (std::size_t i = 20; i != reference.size(); ++i) reference[i].timestamp += 100.0;
  CHECK(eval::rpe(reference, reference, {.delta_seconds = 0.1}).value().translation.count == 38);
}

TEST_CASE("a delta below the resolution of the time stamps finds no motion") {
  auto reference = curve(10);
  for (orbis::stamped_pose& pose : reference) pose.timestamp += 1.3e9;
  CHECK(eval::rpe(reference, reference, {.delta_seconds = 1e-9}).error().code == orbis::errc::no_data);
}

TEST_CASE("a relative error of too little is refused") {
  const auto reference = curve(10);
  CHECK(eval::rpe({}, reference).error().code == orbis::errc::no_data);
  CHECK(eval::rpe(curve(1), reference).error().code == orbis::errc::no_data);
  CHECK(eval::rpe(reference, reference, {.delta_frames = 10}).error().code == orbis::errc::no_data);
  CHECK(eval::rpe(reference, reference, {.delta_seconds = 50.0}).error().code == orbis::errc::no_data);
  CHECK(eval::rpe(reference, reference, {.delta_frames = 0}).error().code == orbis::errc::invalid_argument);
  CHECK(eval::rpe(reference, reference, {.delta_seconds = -1.0}).error().code == orbis::errc::invalid_argument);
}

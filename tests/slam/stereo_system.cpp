// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <orbis/eval/ate.hpp>
#include <orbis/io/stereo_recording.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/slam/system.hpp>

#include "support/catch.hpp"
#include "support/data.hpp"
#include "support/validate.hpp"

using namespace orbis;

namespace {

double length(const trajectory& poses) {
  double sum = 0.0;
  for (std::size_t i = 1; i < poses.size(); ++i)
    sum += (poses[i].T_world_camera.translation() - poses[i - 1].T_world_camera.translation()).norm();
  return sum;
}

/// From the first to the last pose.
se3 whole_way(const trajectory& poses) { return poses.front().T_world_camera.inverse() * poses.back().T_world_camera; }

}  // namespace

TEST_CASE("A stereo camera's round of a room is as exact as that of an RGB-D camera, and closes the loop") {
  double ours = 0.0, theirs = 0.0;  // sums of two rooms
  for (const std::uint64_t seed : {3, 5}) {
    const io::synthetic_recording room{{.frames = 120, .fps = 10, .seed = seed, .width = 320, .height = 240}};
    const auto both = room.stereo_camera(), one = room.camera();
    slam::system<camera::any_camera> stereo{both.model, slam::stereo_options(both.model.k().fx, *both.baseline)};
    slam::system<camera::any_camera> rgbd{one.model, slam::options{.bf = one.model.k().fx * *one.baseline}};
    for (std::size_t i = 0; i != room.size(); ++i) {
      const auto pair = room.stereo_frame(i).value();
      CHECK(stereo.track(pair.timestamp, pair.left.view(), pair.right.view()).tracked());
      CHECK(rgbd.track(room.frame(i).value()).tracked());
    }
    CHECK(stereo.counters().loops_closed >= 1);
    const auto valid = test::validate(stereo.map());
    CHECK((valid ? "" : valid.error().to_string()) == "");
    ours += eval::ate(stereo.trajectory(), room.ground_truth()).value().translation.rmse;
    theirs += eval::ate(rgbd.trajectory(), room.ground_truth()).value().translation.rmse;
  }
  CAPTURE(ours, theirs);
  CHECK(ours < 1.75 * theirs);
  CHECK(ours < 0.01);
}

TEST_CASE("A drive with a stereo camera is as long as it was") {
  ORBIS_NEEDS_DATA("kitti_stereo_a");
  const auto folder = test::data_dir() / "kitti_stereo_a";
  const auto recording = io::open_stereo_recording(folder).value();
  const auto settings = recording.camera();
  slam::stereo_system slam{settings.model, slam::stereo_options(settings.model.k().fx, *settings.baseline)};
  for (std::size_t i = 0; i != recording.size(); ++i) {
    const auto pair = recording.frame(i).value();
    CHECK(slam.track(pair.timestamp, pair.left.view(), pair.right.view()).tracked());
  }
  const trajectory found = slam.trajectory(), &truth = recording.ground_truth();
  REQUIRE(found.size() == 51);
  const se3 error = whole_way(truth).inverse() * whole_way(found);
  CHECK(error.translation().norm() < 0.015 * length(truth));
  CHECK(error.rotation().angle() < 0.02);  // most of it within the first second, where the truth's is settling
  CHECK(std::abs(length(found) / length(truth) - 1.0) < 0.015);
}

TEST_CASE("A system takes a stereo pair, or colour and depth, whichever it is given") {
  const io::synthetic_recording room{{.frames = 3, .seed = 3, .width = 320, .height = 240, .frames_around = 300}};
  const auto both = room.stereo_camera();
  slam::stereo_system stereo{both.model, slam::stereo_options(both.model.k().fx, *both.baseline)};
  slam::system<camera::any_camera> any{both.model, slam::stereo_options(both.model.k().fx, *both.baseline)};
  for (std::size_t i = 0; i != room.size(); ++i) {
    const auto pair = room.stereo_frame(i).value();
    CHECK(stereo.track(pair.timestamp, pair.left.view(), pair.right.view()).tracked());
    CHECK(any.track(pair.timestamp, pair.left.view(), pair.right.view()).tracked());
  }
  CHECK(any.landmark_count() == stereo.landmark_count());
  // Images of another size than the camera's are lost.
  const image<rgb8> small(160, 120);
  CHECK(!stereo.track(10.0, small.view(), small.view()).tracked());
}

// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>

#include <orbis/eval/rpe.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/slam/detail/tracking/young_frames.hpp>

#include "slam/tested_system.hpp"
#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("The first frames of a map are localised again in the map that later keyframes have improved") {
  io::synthetic_options o{.frames = 100, .fps = 30.0, .seed = 4, .width = 320, .height = 240, .frames_around = 400};
  o.path.jitter = 5.0;
  const auto errors_of = [&](const camera::shutter& shutter) {
    o.sensor.shutter = shutter;
    const io::synthetic_recording frames{o};
    slam::options settings;
    settings.initial_pose = frames.T_world_camera(0);
    settings.shutter = shutter;
    test::slam_system slam{frames.camera().model, settings};
    trajectory tracked, young;
    for (std::size_t i = 0; i != frames.size(); ++i) {
      const auto found = slam.track(frames.frame(i).value());
      REQUIRE(found.tracked());
      if (i < 40) tracked.push_back({frames.timestamp(i), *found.T_world_camera});
    }
    for (const stamped_pose& p : slam.trajectory())
      if (young.size() != tracked.size()) young.push_back(p);
    const double at_once = eval::rpe(tracked, frames.ground_truth())->translation.rmse;
    const double again = eval::rpe(young, frames.ground_truth())->translation.rmse;
    CAPTURE(at_once, again);
    CHECK(again < 0.9 * at_once);
  };
  errors_of({});
  errors_of({.color_read_out = 0.03, .depth_read_out = 0.03});
}

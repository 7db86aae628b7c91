// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>

#include <orbis/eval/rpe.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/slam/detail/tracking/young_frames.hpp>

#include "slam/tested_system.hpp"
#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("The first frames of a map are localised again in the map that later keyframes have improved") {
  io::synthetic_options o{.frames = 100, .fps = 30.0, .seed = 2, .width = 320, .height = 240, .frames_around = 400};
  o.path.jitter = 5.0;
  const io::synthetic_recording frames{o};
  slam::options settings;
  settings.estimates_shutter = GENERATE(false, true);  // it is global
  const bool is_short = !settings.estimates_shutter && GENERATE(false, true);
  if (is_short) settings.trajectory_frames = 99;  // too short for a second localisation
  settings.initial_pose = frames.T_world_camera(0);
  test::slam_system slam{frames.camera().model, settings};
  trajectory tracked, again;
  for (std::size_t i = 0; i != frames.size(); ++i) {
    const auto found = slam.track(frames.frame(i).value());
    REQUIRE(found.tracked());
    if (i < 60) tracked.push_back({frames.timestamp(i), *found.T_world_camera});
  }
  for (const stamped_pose& p : slam.trajectory())
    if (again.size() != tracked.size()) again.push_back(p);
  // Without the second localisation, corrections of keyframes improve these by 3 %.
  const double error_tracked = eval::rpe(tracked, frames.ground_truth())->translation.rmse;
  const double error_again = eval::rpe(again, frames.ground_truth())->translation.rmse;
  CAPTURE(settings.estimates_shutter, is_short, error_tracked, error_again);
  CHECK((error_again < 0.92 * error_tracked) == !is_short);
}

// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include <orbis/camera/any.hpp>
#include <orbis/eval/scale.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/slam/calibration.hpp>

#include "slam/tested_system.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

const io::synthetic_recording& room() {
  static const io::synthetic_recording made{
      {.frames = 120, .fps = 15, .seed = 4, .width = 320, .height = 240, .scene = {.poor_walls = 0}}};
  return made;
}

/// As the app does it: track, refine, and again.
struct outcome {
  result<slam::calibration<camera::any_camera>> camera;
  trajectory poses;
};
outcome calibrate(camera::any_camera model, std::size_t frames, double depth_factor, int rounds,
                  const slam::calibration_options& options = {}) {
  const slam::options settings{.bf = 0.075 * model.k().fx};
  for (int round = 1;; ++round) {
    test::slam_system slam{model, settings};
    for (std::size_t i = 0; i != frames; ++i) {
      auto frame = room().frame(i).value();
      frame.depth_scale *= depth_factor;
      slam.track(frame);
    }
    auto found = slam.inspect([&](const slam::atlas& maps) {
      return std::optional{slam::calibrate(maps.active(), slam::make_rig(model, settings), options)};
    });
    if (round == rounds || !*found) return {*std::move(found), slam.trajectory()};
    model = (*found)->camera;
  }
}

}  // namespace

TEST_CASE("Wrong focal lengths and a wrong depth scale are found by a round through a room") {
  const auto k = room().camera().model.k();
  auto wrong = k;
  wrong.fx *= 1.03;
  wrong.fy *= 1.03;
  const auto found = calibrate(camera::pinhole{wrong}, room().size(), 1.02, 3);
  REQUIRE(found.camera);
  const auto& c = *found.camera;
  INFO(c.camera.k().fx << " +- " << c.parameters[0].deviation);
  CHECK(std::abs(c.camera.k().fx / k.fx - 1.0) < 0.005);
  CHECK(c.camera.k().fx == Approx(c.camera.k().fy));
  CHECK(std::abs(c.camera.k().cx - k.cx) < 2.0);
  CHECK(c.parameters.size() == 4);
  CHECK(c.parameters[0].name == "fx");
  CHECK(c.is_complete());
  CHECK(c.parameters[0].deviation > 0.0);
  CHECK(c.parameters[0].deviation < 0.005 * k.fx);
  CHECK(c.final_rms <= c.initial_rms);
  const auto scale = eval::estimate_scale(found.poses, room().ground_truth());
  REQUIRE(scale);
  INFO(scale->scale << " +- " << scale->deviation);
  CHECK(std::abs(scale->scale / 1.02 - 1.0) < 0.015);  // a small camera: its trajectory is no better
}

TEST_CASE("A camera that hardly moves is not calibrated") {
  const auto found = calibrate(room().camera().model, 6, 1.0, 1);
  if (found.camera) CHECK_FALSE(found.camera->is_complete());
  if (!found.camera)
    CHECK((found.camera.error().code == errc::degenerate || found.camera.error().code == errc::no_data));
}

TEST_CASE("Distortion does not make up for a focal length that is held") {
  auto wrong = room().camera().model.k();
  wrong.fx *= 1.05;
  wrong.fy *= 1.05;
  const auto found = calibrate(camera::any_camera{camera::radial_tangential{wrong, {}}}, 40, 1.0, 1);
  if (found.camera)
    for (const auto& p : found.camera->parameters)
      if (found.camera->parameters[0].is_held) CHECK(p.is_held);
  if (!found.camera) CHECK(found.camera.error().code == errc::degenerate);
}

TEST_CASE("Some of the keyframes and landmarks do if there are too many") {
  const auto found =
      calibrate(room().camera().model, room().size(), 1.0, 1, {.max_keyframes = 12, .max_landmarks = 250});
  REQUIRE(found.camera);
  CHECK(found.camera->keyframes == 12);
  CHECK(found.camera->landmarks == 250);
  CHECK(std::abs(found.camera->camera.k().fx / room().camera().model.k().fx - 1.0) < 0.02);
}

TEST_CASE("Parameters that are not determined well enough are held, or all are free") {
  camera::any_camera lens{camera::radial_tangential{room().camera().model.k(), {}}};
  const auto strict = calibrate(lens, 60, 1.0, 1, {.max_effect = 1e-6});
  REQUIRE_FALSE(strict.camera);
  CHECK(strict.camera.error().code == errc::degenerate);
  const auto usual = calibrate(lens, 60, 1.0, 1);
  REQUIRE(usual.camera);
  CHECK(usual.camera->parameters.size() == 8);
  CHECK_FALSE(usual.camera->is_complete());
  const auto complete = calibrate(lens, 60, 1.0, 1, {.needs_all = true});
  REQUIRE_FALSE(complete.camera);
  CHECK(complete.camera.error().code == errc::degenerate);
  const auto generous = calibrate(lens, 60, 1.0, 1, {.max_effect = 1e6});
  REQUIRE(generous.camera);
  CHECK(generous.camera->is_complete());
  for (const auto& p : usual.camera->parameters) CHECK((p.is_held ? p.after == p.before : p.deviation > 0.0));
}

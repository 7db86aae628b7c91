// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/eval/rpe.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/optimize/alignment.hpp>

#include "slam/tested_system.hpp"
#include "support/catch.hpp"
#include "support/data.hpp"
#include "support/validate.hpp"

using namespace orbis;

namespace {

using frames = std::vector<camera::rgbd_frame>;

struct room {
  camera::any_camera camera;
  frames recorded;
};

/// Sixty frames of a walk through a synthetic room, rendered once.
const room& small_room() {
  static const room r = [] {
    const io::synthetic_recording recording{
        {.frames = 60, .seed = 5, .width = 320, .height = 240, .frames_around = 300}};
    room made{recording.camera().model, {}};
    for (std::size_t i = 0; i < recording.size(); ++i) made.recorded.push_back(recording.frame(i).value());
    return made;
  }();
  return r;
}

template <class Poses>
double ate(const Poses& trajectory, const frames& truth) {
  std::vector<vec3> estimated, exact;
  for (const stamped_pose& p : trajectory)
    for (const auto& f : truth)
      if (f.timestamp == p.timestamp && f.T_world_camera) {
        estimated.push_back(p.T_world_camera.translation());
        exact.push_back(f.T_world_camera->translation());
      }
  const auto T = optimize::absolute_orientation(estimated, exact);
  if (!T || estimated.size() != trajectory.size()) return std::numeric_limits<double>::infinity();
  double sum = 0.0;
  for (std::size_t i = 0; i < exact.size(); ++i) sum += (*T * estimated[i] - exact[i]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(exact.size()));
}

}  // namespace

TEST_CASE("A walk through a synthetic room is tracked without a lost frame and within a centimetre") {
  const auto& [camera, recorded] = small_room();
  test::slam_system slam{camera, slam::options{}};
  CHECK(slam.state() == slam::track_state::not_started);
  std::uint32_t keyframes = 0;
  for (const auto& f : recorded) {
    const auto begin = std::chrono::steady_clock::now();
    const auto r = slam.track(f);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
    CHECK(r.timings.features_ms + r.timings.tracking_ms + r.timings.mapping_ms <= took.count());
    CHECK(r.tracked());
    CHECK(r.state == slam::track_state::tracking);
    CHECK(r.inliers >= 20);
    CHECK(r.timings.features_ms > 0.0);
    CHECK(r.timings.tracking_ms > 0.0);
    if (r.keyframe) CHECK(*r.keyframe == keyframes++);
  }
  CHECK(slam.counters().frames == recorded.size());
  CHECK(slam.counters().tracked == recorded.size());
  CHECK(slam.counters().lost == 0);
  CHECK(slam.trajectory().size() == recorded.size());
  CHECK(ate(slam.trajectory(), recorded) < 0.01);
  CHECK(ate(slam.keyframe_trajectory(), recorded) < 0.01);
  CHECK(slam.keyframes().size() == keyframes);
  CHECK(slam.keyframes().front().frame == 0);
  CHECK(slam.landmark_count() > 300);
  const auto valid = test::validate(slam.map());
  CHECK((valid ? "" : valid.error().to_string()) == "");
}

TEST_CASE("Whoever follows the keyframes' poses is told of each change, and of nothing else") {
  const auto& [camera, recorded] = small_room();
  test::slam_system slam{camera};
  slam::pose_revision seen;
  std::vector<slam::keyframe_pose> followed;
  std::size_t changes = 0, moved = 0;
  for (std::size_t i = 0; i < 60; ++i) {
    slam.track(recorded[i]);
    if (auto now = slam.keyframes_since(seen)) {
      ++changes;
      const std::size_t common = std::min(followed.size(), now->size());
      bool same = true;
      for (std::size_t k = 0; k != common; ++k)
        same = same && followed[k].T_world_camera.to_matrix() == (*now)[k].T_world_camera.to_matrix();
      moved += same ? 0 : 1;
      followed = *std::move(now);
    }
    CHECK_FALSE(slam.keyframes_since(seen));
    const auto all = slam.keyframes();
    REQUIRE(all.size() == followed.size());
    for (std::size_t k = 0; k != all.size(); ++k) {
      CHECK(all[k].frame == followed[k].frame);
      CHECK(all[k].T_world_camera.to_matrix() == followed[k].T_world_camera.to_matrix());
    }
  }
  CHECK(moved > 0);     // by local adjustment
  CHECK(changes < 30);  // most frames make no keyframe
}

TEST_CASE("Whoever shows the last frame gets its features, which of them are tracked, and what its pose follows") {
  const auto& [camera, recorded] = small_room();
  test::slam_system slam{camera};
  CHECK_FALSE(slam.last_frame());
  for (std::size_t i = 0; i < 30; ++i) {
    const auto r = slam.track(recorded[i]);
    const auto shown = slam.last_frame();
    REQUIRE(shown);
    std::size_t tracked = 0;
    bool inside = true;
    for (const auto& f : shown->features) {
      tracked += f.tracked ? 1 : 0;
      inside = inside && f.x >= 0.0F && f.y >= 0.0F && f.x < 320.0F && f.y < 240.0F;
    }
    CHECK(inside);
    CHECK(shown->features.size() > 300);
    // A keyframe's new landmarks are none that were tracked: the first frame has tracked none.
    if (i == 0)
      CHECK(tracked == 0);
    else
      CHECK(tracked >= r.inliers);
    CHECK(tracked < shown->features.size());
    const se3 pose = slam.inspect([&](const slam::atlas& maps) {
      const auto now = maps.current(shown->reference);
      CHECK((!r.keyframe || now == slam::map_keyframe{r.map, *r.keyframe}));
      return maps.at(now.map).pose(now.keyframe) * shown->T_reference_camera;
    });
    CHECK((pose.inverse() * *r.T_world_camera).log().norm() < 1e-12);
  }
  camera::rgbd_frame dark = recorded[30];
  dark.color = image<rgb8>(320, 240);
  dark.depth = image<std::uint16_t>(320, 240);
  CHECK_FALSE(slam.track(dark).tracked());
  CHECK_FALSE(slam.last_frame());
}

TEST_CASE("The first pose is the identity unless the caller knows better") {
  const auto& [camera, recorded] = small_room();
  test::slam_system at_origin{camera};
  test::slam_system placed{camera, slam::options{.initial_pose = recorded.front().T_world_camera}};
  for (std::size_t i = 0; i < 10; ++i) {
    at_origin.track(recorded[i]);
    placed.track(recorded[i]);
  }
  CHECK(at_origin.trajectory().front().T_world_camera.log().norm() < 1e-12);
  const vec3 error =
      placed.trajectory().back().T_world_camera.translation() - recorded[9].T_world_camera->translation();
  CHECK(error.norm() < 0.02);
}

TEST_CASE("A map begins where the caller says by then") {
  const auto& [camera, recorded] = small_room();
  test::slam_system slam{camera};
  const se3 here{so3::exp(vec3(0.3, -1.0, 0.2)), vec3(1, 2, 3)}, there{so3::exp(vec3(-0.5, 0.1, 2.0)), vec3(-4, 0, 1)};
  slam.set_initial_pose(here);
  for (std::size_t i = 0; i < 20; ++i) {
    const slam::track_result r = slam.track(recorded[i]);
    REQUIRE(r.tracked());
    if (i == 0) CHECK((r.T_world_camera->inverse() * here).log().norm() < 1e-12);
    if (i == 5) slam.set_initial_pose(there);  // of the next map, not of this one
  }
  CHECK((slam.trajectory().front().T_world_camera.inverse() * here).log().norm() < 1e-12);

  // Another room, which looks like nothing before: after a while it is a map of its own. Whoever has to find out where
  // it begins is asked then, and not for frames that begin none.
  int asked = 0;
  slam.set_initial_pose([&] {
    ++asked;
    return there;
  });
  const io::synthetic_recording elsewhere{
      {.frames = 60, .seed = 77, .width = camera.width(), .height = camera.height(), .frames_around = 360}};
  std::optional<se3> first;
  for (std::size_t i = 0; i < elsewhere.size() && !first; ++i) {
    camera::rgbd_frame frame = elsewhere.frame(i).value();
    frame.timestamp += recorded[20].timestamp;
    if (const slam::track_result r = slam.track(frame); r.tracked()) first = r.T_world_camera;
  }
  REQUIRE(first);
  CHECK(asked == 1);
  CHECK((first->inverse() * there).log().norm() < 1e-12);
}

TEST_CASE("Two runs over the same frames give the same bytes") {
  const room& r = small_room();
  const auto run = [&] {
    test::slam_system slam{r.camera, slam::options{}};
    for (std::size_t i = 0; i < 30; ++i) slam.track(r.recorded[i]);
    for (std::size_t i = 45; i < 60; ++i) slam.track(r.recorded[i]);  // a jump, so that RANSAC has its say
    return slam.trajectory();
  };
  const auto a = run(), b = run();
  REQUIRE(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const mat4 first = a[i].T_world_camera.to_matrix(), second = b[i].T_world_camera.to_matrix();
    CHECK(std::memcmp(first.data(), second.data(), sizeof(double) * 16) == 0);
  }
}

TEST_CASE("A trajectory of the latest frames is the end of that of all frames") {
  const auto& [camera, recorded] = small_room();
  slam::options few;
  few.trajectory_frames = 5;
  test::slam_system all{camera}, latest{camera, few};
  for (std::size_t i = 0; i < 15; ++i) {
    all.track(recorded[i]);
    latest.track(recorded[i]);
    const auto expected = all.trajectory(), found = latest.trajectory();
    REQUIRE(found.size() == std::min<std::size_t>(i + 1, 5));
    for (std::size_t k = 0; k < found.size(); ++k) {
      const stamped_pose& same = expected[expected.size() - found.size() + k];
      CHECK(found[k].timestamp == same.timestamp);
      CHECK(found[k].T_world_camera.to_matrix() == same.T_world_camera.to_matrix());
    }
  }
}

TEST_CASE("In the dark tracking is lost and comes back with the light") {
  const auto& [camera, recorded] = small_room();
  test::slam_system slam{camera, slam::options{}};
  frames with_blackout = recorded;
  for (std::size_t i = 25; i < 35; ++i) {
    with_blackout[i].color = image<rgb8>(camera.width(), camera.height());
    with_blackout[i].depth = image<std::uint16_t>(camera.width(), camera.height());
  }
  for (std::size_t i = 0; i < with_blackout.size(); ++i) {
    const auto r = slam.track(with_blackout[i]);
    const bool dark = i >= 25 && i < 35;
    CHECK(r.tracked() == !dark);
    if (dark) {
      CHECK(r.state == slam::track_state::lost);
      CHECK_FALSE(r.keyframe.has_value());
    }
    if (i == 35) CHECK(r.state == slam::track_state::relocalized);
    if (i > 35) CHECK(r.state == slam::track_state::tracking);
  }
  CHECK(slam.counters().lost == 10);
  CHECK(slam.counters().relocalized == 1);
  CHECK(slam.trajectory().size() == recorded.size() - 10);
  CHECK(ate(slam.trajectory(), recorded) < 0.015);
}

TEST_CASE("Images without anything to see never start the system and never harm it") {
  const auto& [camera, recorded] = small_room();
  test::slam_system slam{camera, slam::options{}};
  camera::rgbd_frame grey;
  grey.color = image<rgb8>(camera.width(), camera.height(), rgb8{128, 128, 128});
  grey.depth = image<std::uint16_t>(camera.width(), camera.height(), 2000);
  for (int i = 0; i < 3; ++i) CHECK(slam.track(grey).state == slam::track_state::not_started);
  CHECK(slam.trajectory().empty());
  CHECK(slam.counters().lost == 0);

  CHECK(slam.track(recorded[0]).tracked());
  CHECK(slam.track(grey).state == slam::track_state::lost);
  CHECK(slam.track(camera::rgbd_frame{}).state == slam::track_state::lost);  // no image at all
  CHECK(slam.track(recorded[1]).state == slam::track_state::relocalized);

  auto no_depth = recorded[2];
  no_depth.depth = image<std::uint16_t>(camera.width(), camera.height());
  CHECK(slam.track(no_depth).tracked());  // landmarks need no depth to be seen again
  auto all_depth = recorded[3];
  all_depth.depth = image<std::uint16_t>(camera.width(), camera.height(), 1);
  slam.track(all_depth);
  for (std::size_t i = 4; i < 8; ++i) CHECK(slam.track(recorded[i]).tracked());
}

TEST_CASE("A frame without any depth starts nothing whatever the options say") {
  const auto& [camera, recorded] = small_room();
  slam::options options;
  options.min_start_points = 0;
  test::slam_system slam{camera, options};
  auto no_depth = recorded[0];
  no_depth.depth = image<std::uint16_t>(camera.width(), camera.height());
  CHECK(slam.track(no_depth).state == slam::track_state::not_started);
  CHECK(slam.track(recorded[1]).tracked());
}

TEST_CASE("A camera at rest makes no keyframes") {
  const auto& [camera, recorded] = small_room();
  test::slam_system slam{camera};
  auto f = recorded[0];
  for (int i = 0; i < 20; ++i) {
    CHECK(slam.track(f).tracked());
    f.timestamp += 0.1;
  }
  CHECK(slam.keyframes().size() == 1);
  CHECK(slam.trajectory().back().T_world_camera.log().norm() < 1e-3);
}

TEST_CASE("A frame without a time is lost, and the clock goes on as before") {
  const auto& [camera, recorded] = small_room();
  for (const double time : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    test::slam_system slam{camera};
    auto timeless = recorded[2];
    timeless.timestamp = time;
    CHECK_FALSE(slam.track(timeless).tracked());
    for (std::size_t i = 0; i < 2; ++i) CHECK(slam.track(recorded[i]).state == slam::track_state::tracking);
    CHECK(slam.track(timeless).state == slam::track_state::lost);
    CHECK(slam.track(recorded[3]).state == slam::track_state::relocalized);
    CHECK(slam.track(recorded[4]).state == slam::track_state::tracking);
    CHECK(slam.active_map() == 0);
    for (const stamped_pose& p : slam.trajectory()) CHECK(std::isfinite(p.timestamp));
  }
}

TEST_CASE("The largest map is one of those there are") {
  const auto& [camera, recorded] = small_room();
  slam::options o;
  o.recovery.min_inliers = 1'000'000;  // nothing is ever found again
  test::slam_system slam{camera, o};
  auto f = recorded[0];
  for (int i = 0; i < 6; ++i, f.timestamp += 0.1) CHECK(slam.track(f).tracked());  // one keyframe: a map that will go
  camera::rgbd_frame dark;
  dark.timestamp = f.timestamp;
  CHECK(slam.track(dark).state == slam::track_state::lost);
  f.timestamp += 2.0;
  CHECK(slam.track(f).tracked());
  CHECK(slam.active_map() == 1);
  CHECK(slam.largest_map() == 1);
  CHECK(slam.trajectory(slam.largest_map()).size() == 1);
}

TEST_CASE("The kitchen is tracked without a lost frame") {
  ORBIS_NEEDS_DATA("kitchen");
  auto recording = io::open_recording(test::data_dir() / "kitchen").value();
  test::slam_system slam{recording.camera().model, slam::options{}};
  frames truth;
  for (std::size_t i = 0; i < 300; i += 3) {
    const auto f = recording.frame(i).value();
    CHECK(slam.track(f).tracked());
    truth.emplace_back();
    truth.back().timestamp = f.timestamp;
    truth.back().T_world_camera = f.T_world_camera;
  }
  CHECK(ate(slam.trajectory(), truth) < 0.06);
}

TEST_CASE("Depth in the pose lowers the error from frame to frame") {
  ORBIS_NEEDS_DATA("fr1_xyz_220");
  const auto recording = io::open_recording(test::data_dir() / "fr1_xyz_220").value();
  const auto error = [&](bool depth) {
    slam::options settings;
    settings.shutter = {.color_read_out = 0.02, .depth_delay = -0.01};
    settings.depth_term.enabled = settings.depth_term.recovers = depth;
    double sum = 0.0;
    for (const std::size_t first : {0, 55, 110}) {  // the ratio for one part varies between 0.8 and 1.02
      test::slam_system slam{recording.camera().model, settings};
      for (std::size_t i = first; i != first + 55; ++i) CHECK(slam.track(recording.frame(i).value()).tracked());
      sum += eval::rpe(slam.trajectory(), recording.ground_truth())->translation.rmse;
    }
    return sum;
  };
  const double with = error(true), without = error(false);
  CAPTURE(with, without);
  CHECK(with < 0.98 * without);
}

// SPDX-License-Identifier: BSD-3-Clause
//
// What recordings do to SLAM systems: loops, cuts, darkness, people, light, blur, low rates, walls that repeat. All are
// made up, with exact poses.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <orbis/eval/ate.hpp>
#include <orbis/eval/rpe.hpp>
#include <orbis/io/synthetic.hpp>

#include "slam/tested_system.hpp"
#include "support/catch.hpp"
#include "support/synthetic/close_people.hpp"
#include "support/synthetic/effects.hpp"
#include "support/synthetic/sequence.hpp"
#include "support/validate.hpp"

using namespace orbis;
namespace syn = test;

namespace {

struct outcome {
  slam::track_counters counters;
  std::vector<slam::track_state> states;  ///< by frame
  std::size_t in_map = 0;                 ///< frames whose pose is known in the active map
  std::size_t maps = 0;
  double ate = -1.0;  ///< metres, RMSE
  double end = -1.0;  ///< metres: where the last frame should be and is, in the world of the first
};

/// The poses as they are after the last frame.
template <class Sequence>
outcome judge(const test::slam_system& slam, const Sequence& frames, std::vector<slam::track_state> states) {
  outcome o{slam.counters(), std::move(states), 0, slam.inspect([](const slam::atlas& a) { return a.size(); })};
  const trajectory found = slam.trajectory();
  o.in_map = found.size();
  if (const auto ate = eval::ate(found, syn::ground_truth_of(frames))) o.ate = ate->translation.rmse;
  const std::size_t last = frames.size() - 1;
  if (!found.empty() && found.back().timestamp == frames.timestamp(last))
    o.end = (found.back().T_world_camera.translation() - frames.T_world_camera(last).translation()).norm();
  const auto valid = test::validate(slam.map());
  CHECK((valid ? "" : valid.error().to_string()) == "");
  return o;
}

template <class Sequence>
slam::options options_for(const Sequence& frames) {
  slam::options o;
  o.initial_pose = frames.T_world_camera(0);
  return o;
}

template <class Sequence>
outcome run(const Sequence& frames, const slam::options& settings) {
  test::slam_system slam{frames.camera().model, settings};
  std::vector<slam::track_state> states;
  for (std::size_t i = 0; i != frames.size(); ++i) {
    const slam::track_result r = slam.track(frames.frame(i).value());
    states.push_back(r.state);
    if (r.keyframe)  // by the name it has now, even if its map has just become a part of another
      CHECK(slam.inspect([&](const slam::atlas& a) { return a.at(r.map).has_keyframe(*r.keyframe); }));
  }
  return judge(slam, frames, std::move(states));
}

template <class Sequence>
outcome run(const Sequence& frames) {
  return run(frames, options_for(frames));
}
/// As without a depth image in the pose.
template <class Sequence>
outcome run_on_features(const Sequence& frames) {
  slam::options settings = options_for(frames);
  settings.depth_term.enabled = settings.depth_term.recovers = false;
  return run(frames, settings);
}

/// Frames cost time: few of them, and small ones.
syn::sequence_options small(double fps) { return {.width = 320, .height = 240, .fps = fps}; }

}  // namespace

TEST_CASE("A round through a building comes out where it began once the loop is closed, and not without") {
  syn::loop_options o;
  o.sequence = small(10);
  const auto frames = syn::corridor_loop(o);
  test::slam_system closing{frames.camera().model, options_for(frames)};
  slam::options without = options_for(frames);
  without.places.enabled = false;
  test::slam_system drifting{frames.camera().model, without};
  std::vector<slam::track_state> states, others;
  for (std::size_t i = 0; i != frames.size(); ++i) {
    const auto f = frames.frame(i).value();
    states.push_back(closing.track(f).state);
    others.push_back(drifting.track(f).state);
  }
  const outcome closed = judge(closing, frames, states), drifted = judge(drifting, frames, others);
  CHECK(closed.counters.lost == 0);
  CHECK(closed.counters.loops_closed >= 1);
  CHECK(closed.maps == 1);
  CHECK(closed.in_map == frames.size());
  CHECK(closed.end < 0.01);
  CHECK(closed.ate < 0.02);
  CHECK(drifted.counters.loops_closed == 0);
  CHECK(drifted.end > 0.02);
  CHECK(drifted.ate > 1.5 * closed.ate);
}

TEST_CASE("Walls that all look the same close no loop where there is none, and the true one") {
  syn::loop_options o;
  o.sequence = small(10);
  o.building.wall_period = 0.8;
  const auto frames = syn::corridor_loop(o);
  const outcome seen = run(frames);
  CHECK(seen.counters.lost == 0);
  CHECK(seen.counters.loops_closed >= 1);
  CHECK(seen.end < 0.02);
  CHECK(seen.ate < 0.03);
}

TEST_CASE("A camera that is carried off is found again as soon as it sees what it knows") {
  syn::room_options o;
  o.sequence = small(10);
  const auto room = syn::room_round(o);
  // Five seconds, then at once three seconds back, and on from there.
  std::vector<syn::selection<std::remove_const_t<decltype(room)>>::pick> picks;
  for (std::size_t i = 0; i != 50; ++i) picks.push_back({i, room.timestamp(i)});
  for (std::size_t i = 20; i != 50; ++i) picks.push_back({i, room.timestamp(i + 30)});
  const syn::selection frames{room, picks, 10.0};
  const outcome seen = run(frames);
  const auto found = std::find_if(seen.states.begin() + 50, seen.states.end(),
                                  [](slam::track_state s) { return s != slam::track_state::lost; });
  CHECK(found - (seen.states.begin() + 50) < 5);
  CHECK(seen.counters.relocalized >= 1);
  CHECK(seen.counters.lost < 5);
  CHECK(seen.maps == 1);
  CHECK(seen.ate < 0.015);
}

TEST_CASE("A camera that is carried to where nothing is known begins a map, which becomes part of the first one") {
  syn::room_options o;
  o.sequence = small(10);
  const auto frames = syn::without(syn::room_round(o), {4.0, 8.0});
  const outcome seen = run(frames);
  CHECK(seen.counters.lost == 0);
  CHECK(seen.counters.maps_merged == 1);
  CHECK(seen.maps == 1);
  CHECK(seen.in_map == frames.size());
  CHECK(seen.ate < 0.015);
  CHECK(seen.end < 0.01);
}

TEST_CASE("Two seconds in the dark cost these two seconds") {
  syn::room_options o;
  o.sequence = small(10);
  const auto frames = syn::blacked_out(syn::room_round(o), {4.0, 6.0});
  const outcome seen = run(frames);
  CHECK(seen.counters.lost == 20);
  for (std::size_t i = 0; i != frames.size(); ++i)
    CHECK((seen.states[i] == slam::track_state::lost) == (i >= 40 && i < 60));
  CHECK(seen.maps == 1);
  CHECK(seen.in_map == frames.size() - 20);
  CHECK(seen.ate < 0.015);
  CHECK(seen.end < 0.01);
}

TEST_CASE("Who walks through the view does not carry the map along") {
  syn::room_options o;
  o.sequence = small(10);
  o.people = {{.begin = 3.0, .end = 7.0, .from = {2.0, 1.6}, .to = {2.0, -1.6}}};
  const outcome seen = run(syn::room_round(o));
  CHECK(seen.counters.lost == 0);
  CHECK(seen.ate < 0.02);
  CHECK(seen.end < 0.02);
}

TEST_CASE("Who fills half of the view does not carry the camera along") {
  syn::company_options o;
  o.sequence = small(15);
  SECTION("crosses, slowly where it comes into view") { o.what = syn::company::crosses; }
  SECTION("stops and goes on") { o.what = syn::company::stops; }
  SECTION("goes along with the camera") { o.what = syn::company::goes_along; }
  const auto frames = syn::with_company(o);
  test::slam_system slam{frames.camera().model, options_for(frames)};
  slam::options settings = options_for(frames);
  settings.moving.enabled = false;
  test::slam_system carried{frames.camera().model, settings};
  std::vector<slam::track_state> states, others;
  std::size_t on_body = 0, elsewhere = 0;  // of what is left out
  for (std::size_t i = 0; i != frames.size(); ++i) {
    const auto f = frames.frame(i).value();
    states.push_back(slam.track(f).state);
    others.push_back(carried.track(f).state);
    const auto shown = slam.last_frame();
    REQUIRE(shown);
    for (const slam::tracked_feature& at : shown->features) {
      if (!at.moving) continue;
      const auto direction =
          frames.camera().model.unproject(vec2(static_cast<double>(at.x), static_cast<double>(at.y)));
      const se3 T = frames.T_world_camera(i);
      const auto room = frames.place().cast(T.translation(), T.rotation() * *direction);
      const auto z = f.depth_metres()(static_cast<int>(at.x), static_cast<int>(at.y));
      if (!room || !(z > 0.0F)) continue;
      ++(static_cast<double>(z) < *room - 0.1 ? on_body : elsewhere);
    }
  }
  const outcome seen = judge(slam, frames, std::move(states)), off = judge(carried, frames, std::move(others));
  CHECK(seen.counters.lost == 0);
  CHECK(seen.ate < 0.02);
  CHECK(seen.end < 0.02);
  CHECK(off.ate > 0.1);
  CHECK(on_body > 1000);
  CHECK(on_body > 5 * elsewhere);
}

TEST_CASE("Jumps of exposure, motion blur and low rates are tracked through") {
  syn::room_options o;
  o.sequence = small(10);
  const auto check = [](const outcome& seen, double ate) {
    CHECK(seen.counters.lost == 0);
    CHECK(seen.ate < ate);
    CHECK(seen.end < 0.01);
  };
  SECTION("exposure") { check(run(syn::with_exposure(syn::room_round(o))), 0.02); }
  SECTION("15 frames a second") {
    o.sequence.fps = 15;
    check(run(syn::room_round(o)), 0.015);
  }
  SECTION("10 frames a second") { check(run(syn::room_round(o)), 0.015); }
  SECTION("motion blur") {
    o.sequence.sensor.motion_blur = 4;
    o.sequence.sensor.exposure = 0.03;
    check(run(syn::room_round(o)), 0.025);
  }
}

TEST_CASE("Walls that all look the same, and walls with little on them, are told apart by what stands before them") {
  syn::room_options o;
  o.sequence = small(10);
  SECTION("the same") { o.scene.wall_period = 0.8; }
  SECTION("bare") { o.scene.poor_walls = 4; }
  const outcome seen = run(syn::room_round(o));
  CHECK(seen.counters.lost == 0);
  CHECK(seen.ate < 0.02);
  CHECK(seen.end < 0.02);
}

TEST_CASE("Depth holds the camera where it is dark, and the map goes on") {
  syn::room_options o;
  o.sequence = small(10);
  o.sequence.frames = 130;
  o.duration = 30.0;
  o.seed = 2;
  const auto frames = syn::changed{syn::room_round(o), [](camera::rgbd_frame& f, std::size_t i) {
                                     if (i >= 40 && i < 60)
                                       std::fill(f.color.pixels().begin(), f.color.pixels().end(), rgb8{});
                                   }};
  const outcome held = run(frames), lost = run_on_features(frames);
  CAPTURE(held.ate, held.end, lost.ate);
  CHECK(lost.counters.lost == 20);
  CHECK(held.counters.lost <= 5);
  CHECK(held.maps == 1);
  CHECK(held.ate < 0.015);
  CHECK(held.end < 0.04);
}

TEST_CASE("Depth and few landmarks together hold a camera before bare walls that sees little of what it saw before") {
  syn::room_options o;
  o.sequence.fps = 1.5;
  o.scene.poor_walls = 4;
  o.scene.furniture = false;
  o.scene.texture_density = 0.15;
  o.seed = 3;
  o.duration = 40.0;
  const auto frames = syn::room_round(o);
  const outcome held = run(frames), alone = run_on_features(frames);
  CAPTURE(held.ate, held.in_map, alone.ate, alone.in_map, held.counters.lost, alone.counters.lost, held.maps);
  CHECK(held.in_map > alone.in_map + 5);
  CHECK(held.ate < 0.03);
}

TEST_CASE("Depth in the pose lowers the error from frame to frame if the images are noisy") {
  io::synthetic_options o{.frames = 80, .fps = 30.0, .seed = 3, .width = 320, .height = 240, .frames_around = 400};
  o.sensor.colour_noise = 20.0;
  const io::synthetic_recording frames{o};
  const auto error = [&](bool depth) {
    slam::options settings;
    settings.depth_term.enabled = settings.depth_term.recovers = depth;
    test::slam_system slam{frames.camera().model, settings};
    for (std::size_t i = 0; i != frames.size(); ++i) slam.track(frames.frame(i).value());
    CHECK(slam.counters().lost == 0);
    return eval::rpe(slam.trajectory(), frames.ground_truth())->translation.rmse;
  };
  const double with = error(true), without = error(false);
  CAPTURE(with, without);
  CHECK(with < without);
}

TEST_CASE("A rolling shutter costs little where it is known, and much where it is not") {
  io::synthetic_options o{.frames = 120, .fps = 30.0, .seed = 3, .width = 320, .height = 240, .frames_around = 400};
  o.path.jitter = 5.0;
  o.sensor = io::synthetic_sensor_options::ideal();
  const auto error_of = [&](const camera::shutter& is, const camera::shutter& known, double stamped_later = 0.0) {
    o.sensor.shutter = is;
    const io::synthetic_recording frames{o};
    slam::options settings;
    settings.initial_pose = frames.T_world_camera(0);
    settings.shutter = known;
    test::slam_system slam{frames.camera().model, settings};
    std::vector<slam::track_state> states;
    double turned_off = 0.0;  // by the twist, radians per second
    for (std::size_t i = 0; i != frames.size(); ++i) {
      camera::rgbd_frame f = frames.frame(i).value();
      if (stamped_later != 0.0) f.depth_timestamp = f.timestamp + stamped_later;
      const slam::track_result found = slam.track(f);
      states.push_back(found.state);
      CHECK(found.shutter.depth_delay == Approx(known.depth_delay + stamped_later));
      if (known.is_global()) CHECK(found.twist == vec6::Zero());
      if (i == 0 || i + 1 == frames.size()) continue;
      const vec6 motion = (frames.T_world_camera(i - 1).inverse() * frames.T_world_camera(i + 1)).log() * (o.fps / 2.0);
      turned_off += (found.twist - motion).tail<3>().norm() / static_cast<double>(frames.size());
      if (i == 60 && !known.is_global()) CHECK(slam.last_frame()->twist == found.twist);
    }
    CAPTURE(turned_off);
    if (!known.is_global() && is == known) CHECK(turned_off < 0.12);
    const outcome seen = judge(slam, frames, std::move(states));
    CHECK(seen.counters.lost == 0);
    return eval::rpe(slam.trajectory(), frames.ground_truth())->translation.rmse;  // from frame to frame
  };
  const camera::shutter rolling{.color_read_out = 0.03, .depth_read_out = 0.03};
  const double global = error_of({}, {}), modelled = error_of(rolling, rolling), ignored = error_of(rolling, {});
  CAPTURE(global, modelled, ignored);
  CHECK(modelled < 1.6 * global);
  CHECK(ignored > 2.5 * modelled);
  const camera::shutter late{.color_read_out = 0.03, .depth_read_out = 0.03, .depth_delay = 0.015};
  const double followed = error_of(late, late), missed = error_of(late, rolling);
  const double stamped = error_of(late, rolling, 0.015);
  CAPTURE(followed, missed, stamped);
  CHECK(followed < 0.85 * missed);
  CHECK(stamped == Approx(followed).epsilon(0.02));
  // Where all rows are of one time, only the poses around a frame tell how it moves.
  const camera::shutter early{.depth_delay = -0.015}, much_earlier{.depth_delay = -0.03};
  const double early_followed = error_of(early, early), early_missed = error_of(early, {});
  const double much_earlier_followed = error_of(much_earlier, much_earlier);
  CAPTURE(early_followed, early_missed, much_earlier_followed);
  CHECK(early_followed < 0.95 * early_missed);
  CHECK(much_earlier_followed < 2.7 * global);
}

TEST_CASE("Depth that lags or comes early is found to two milliseconds") {
  io::synthetic_options o{.frames = 420, .fps = 30.0, .seed = 3, .width = 320, .height = 240, .frames_around = 400};
  o.path.jitter = 3.0;
  for (const double delay : {-0.015, 0.0, 0.008}) {
    o.sensor.shutter.depth_delay = delay;
    const io::synthetic_recording frames{o};
    slam::options settings;
    settings.estimates_shutter = true;
    test::slam_system slam{frames.camera().model, settings};
    for (std::size_t i = 0; i != frames.size(); ++i) slam.track(frames.frame(i).value());
    const slam::shutter_estimate found = *slam.estimated_shutter();
    CAPTURE(delay, found.delay, found.delay_deviation, found.read_out);
    CHECK(std::abs(found.delay - delay) < 0.002);
    CHECK(std::abs(found.shutter.depth_delay - delay) < 0.002);
    CHECK(found.delay_deviation < 0.002);
    CHECK(std::abs(found.delay - delay) < 2.0 * found.delay_deviation);
  }
}

TEST_CASE("The shutter is found from the frames") {
  io::synthetic_options o{.frames = 250, .fps = 30.0, .seed = 3, .width = 320, .height = 240, .frames_around = 400};
  o.path.jitter = 3.0;
  const auto estimate_of = [&](const camera::shutter& is) {
    o.sensor.shutter = is;
    const io::synthetic_recording frames{o};
    slam::options settings;
    settings.estimates_shutter = true;
    test::slam_system slam{frames.camera().model, settings};
    CHECK(std::isinf(slam.estimated_shutter()->read_out_deviation));
    for (std::size_t i = 0; i != frames.size(); ++i) slam.track(frames.frame(i).value());
    CHECK(slam.estimated_shutter()->observed == Approx(frames.timestamp(249) - frames.timestamp(0)));
    return *slam.estimated_shutter();
  };
  const slam::shutter_estimate rolling =
      estimate_of({.color_read_out = 0.025, .depth_read_out = 0.025, .depth_delay = 0.012});
  CHECK(std::abs(rolling.shutter.color_read_out - 0.025) < 0.002);
  CHECK(rolling.read_out_deviation < 0.002);
  CHECK(std::abs(rolling.read_out - 0.025) < 2.0 * rolling.read_out_deviation);
  CHECK(std::abs(rolling.delay - 0.012) < 2.0 * rolling.delay_deviation);
  CHECK(std::abs(rolling.shutter.depth_delay - 0.012) < 0.006);  // it takes longer to be known well
  const slam::shutter_estimate global = estimate_of({});
  CHECK(global.shutter.is_global());
  CHECK(global.read_out_deviation < 0.002);
}

TEST_CASE("A shutter that is already known from frames is revised later than a guess") {
  io::synthetic_options o{.frames = 85, .fps = 30.0, .seed = 3, .width = 320, .height = 240, .frames_around = 400};
  o.path.jitter = 3.0;
  const io::synthetic_recording frames{o};
  // Read-outs: assumed for the last frame, and reported.
  const auto last_shutter = [&](double observed) {
    slam::options settings;
    settings.shutter.color_read_out = settings.shutter.depth_read_out = 0.04;  // it is global
    settings.estimates_shutter = true;
    settings.earlier_estimate = {
        .shutter = settings.shutter, .read_out = 0.04, .read_out_deviation = 0.1, .observed = observed};
    test::slam_system slam{frames.camera().model, settings};
    slam::track_result found;
    for (std::size_t i = 0; i != frames.size(); ++i) found = slam.track(frames.frame(i).value());
    return std::pair{found.shutter.color_read_out, slam.estimated_shutter()->read_out};
  };
  CHECK(last_shutter(0.0).first < 0.02);
  CHECK(last_shutter(1.6).first < 0.02);  // revised after 2.5 s, at least 1.5 * 1.6; the recording takes 2.8 s
  CHECK(last_shutter(1.9).first == 0.04);
  CHECK(last_shutter(20.0) == std::pair{0.04, 0.04});
}

// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/camera/depth.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/slam/detail/depth/depth_tracker.hpp>
#include <orbis/slam/detail/depth/surface.hpp>
#include <orbis/slam/detail/tracking/front_end.hpp>
#include <orbis/slam/measure.hpp>

#include "slam/ring_world.hpp"
#include "support/catch.hpp"
#include "support/validate.hpp"

using namespace orbis;
using slam::track_state;

namespace {

using descriptor = features::binary_descriptor<256>;

/// The front end on its own: keyframes are made, and nothing else is done with them.
struct scene {
  test::ring_world world;
  slam::options options;
  slam::atlas maps{8, 1.2};
  slam::detail::front_end<camera::any_camera, descriptor, slam::orb_matchers> front_end{world.rig, options};
  std::vector<slam::map_keyframe> similar;  ///< what place recognition says
  std::vector<slam::map_id> dropped;
  bool is_frozen = false, has_room = true;
  std::size_t frames = 0;

  explicit scene(const test::ring_options& o = {.steps = 60, .drift = 0.0}, const slam::options& settings = {})
      : world{o}, options{settings} {
    options.initial_pose = world.truth(0);
    options.min_start_points = 50;
  }

  std::size_t feed(slam::frame f) {
    f.index = frames++;
    return front_end
        .track({.frame = f,
                .maps = maps,
                .is_frozen = is_frozen,
                .has_room = [&] { return has_room; },
                .read_rows = [](std::span<slam::keypoint_as_read>, const slam::frame_motion&) {},
                .find_similar = [&](const auto&, std::size_t) { return similar; },
                .drop_map =
                    [&](slam::map_id m) {
                      maps.remove(m);
                      dropped.push_back(m);
                    },
                .localized = {}})
        .inliers;
  }
  std::size_t see(std::uint32_t step) { return feed(world.look(step, se3{})); }
  std::size_t see_nothing(double timestamp) {
    slam::frame f;
    f.timestamp = timestamp;
    return feed(f);
  }
  [[nodiscard]] double error(std::uint32_t step) const {
    return (world.truth(step).inverse() * front_end.last_pose(maps)).log().norm();
  }
};

}  // namespace

TEST_CASE("The first frame begins the map, and the ones that follow are tracked in it") {
  scene s;
  CHECK(s.front_end.state() == track_state::not_started);
  CHECK(s.see_nothing(-1.0) == 0);
  CHECK(s.front_end.state() == track_state::not_started);
  for (std::uint32_t i = 0; i < 8; ++i) {
    CHECK(s.see(i) > 30);
    CHECK(s.front_end.state() == track_state::tracking);
    CHECK(s.error(i) < 0.02);
  }
  CHECK(s.maps.active().keyframes().size() >= 4);
  CHECK(s.front_end.counters().frames == 9);
  CHECK(s.front_end.counters().tracked == 8);
  CHECK(s.front_end.counters().lost == 0);
  CHECK(s.front_end.log().trajectory(s.maps, 0).size() == 8);
  CHECK(test::validate(s.maps.active()));
}

TEST_CASE("A camera that was lost is found by appearance, and not before") {
  scene s;
  s.options.recovery.new_map_after = 100.0;
  for (std::uint32_t i = 0; i < 6; ++i) s.see(i);
  CHECK(s.see_nothing(2.6) == 0);
  CHECK(s.front_end.state() == track_state::lost);
  CHECK(s.see(25) == 0);
  CHECK(s.front_end.counters().lost == 2);
  s.similar = {{0, 0}, {0, 2}};
  CHECK(s.see(2) > 40);
  CHECK(s.front_end.state() == track_state::relocalized);
  CHECK(s.error(2) < 0.02);
  CHECK(s.see(3) > 40);
  CHECK(s.front_end.state() == track_state::tracking);
  CHECK(s.front_end.counters().relocalized == 1);
}

TEST_CASE(
    "A camera that is lost for long begins a map, one with few keyframes is dropped, and the old one found again") {
  scene s;
  s.options.recovery.min_map_keyframes = 2;
  for (std::uint32_t i = 0; i < 6; ++i) s.see(i);  // time stamps are half a second apart
  REQUIRE(s.maps.active().keyframes().size() >= 2);
  CHECK(s.see(30) > 0);  // 15 seconds later, in a place that is not known
  CHECK(s.front_end.state() == track_state::tracking);
  CHECK(s.maps.active_id() == 1);
  CHECK(s.maps.contains(0));
  CHECK(s.dropped.empty());
  CHECK(s.see(45) > 0);
  CHECK(s.maps.active_id() == 2);
  CHECK(s.dropped == std::vector<slam::map_id>{1});
  CHECK(s.see_nothing(23.0) == 0);
  s.similar = {{0, 4}};
  CHECK(s.see(4) > 40);
  CHECK(s.maps.active_id() == 0);
  CHECK(s.front_end.log().trajectory(s.maps, 0).size() == 7);
}

TEST_CASE("A frozen map does not change, and none is begun") {
  scene s;
  s.is_frozen = true;
  CHECK(s.see(0) == 0);
  CHECK(s.front_end.state() == track_state::not_started);
  s.is_frozen = false;
  for (std::uint32_t i = 0; i < 6; ++i) s.see(i);
  s.is_frozen = true;
  const slam::map before = s.maps.active();
  for (std::uint32_t i = 6; i < 9; ++i) CHECK(s.see(i) > 20);
  CHECK(s.see(40) == 0);
  CHECK(s.maps.size() == 1);
  CHECK(test::same(before, s.maps.active()));
  for (const auto& l : before.landmarks()) {
    CHECK(s.maps.active().landmark_at(l.id).visible == l.visible);
    CHECK(s.maps.active().landmark_at(l.id).found == l.found);
  }
}

TEST_CASE("No keyframe is made while the back end has no room for it, but a map begins") {
  scene s;
  s.has_room = false;
  for (std::uint32_t i = 0; i < 4; ++i) CHECK(s.see(i) > 30);
  CHECK(s.maps.active().keyframes().size() == 1);
  s.has_room = true;
  CHECK(s.see(4) > 30);
  CHECK(s.maps.active().keyframes().size() == 2);
}

TEST_CASE("Tracking goes on when the map was merged, moved and culled between two frames") {
  scene s;
  const se3 T(so3::exp(vec3(0, 0, 0.7)), vec3(3, -2, 1));
  slam::map& first = s.maps.active();
  s.world.walk(first, 20, 24, T * s.world.truth(20));  // a map made before, in another world
  s.maps.create();
  for (std::uint32_t i = 20; i < 26; ++i) s.see(i);
  REQUIRE(s.maps.active_id() == 1);
  s.options.initial_pose.reset();
  const se3 T_into_from = T * s.world.truth(20) * s.world.truth(0).inverse();
  const auto offsets = s.maps.merge(1, 0, sim3(T_into_from), {3, 0});
  CHECK(offsets.keyframes == 4);
  CHECK(s.see(26) > 30);
  CHECK(s.front_end.state() == track_state::tracking);
  CHECK(s.maps.active_id() == 0);
  CHECK((s.front_end.last_pose(s.maps).inverse() * T * s.world.truth(26)).log().norm() < 0.03);
  CHECK(s.front_end.log().trajectory(s.maps, 0).size() == 7);
}

TEST_CASE("Tracking goes on when a correction has changed the lengths of a map without depth") {
  scene s({.steps = 60, .density = 60.0, .drift = 0.0, .shrinks = 1e-9});
  s.options = slam::monocular_options(s.options);
  s.is_frozen = true;
  s.world.walk(s.maps.active(), 0, 20, s.world.truth(0));
  s.front_end.set_lost();
  s.similar = {{0, 6}};
  for (std::uint32_t i = 7; i != 10; ++i) CHECK(s.see(i) > 40);
  CHECK(s.front_end.state() == track_state::tracking);
  s.similar.clear();
  const sim3 T(so3::exp(vec3(0.2, -0.1, 0.7)), vec3(3, -2, 1), 2.5);
  s.maps.active().transform(T);
  const auto off = [&](const se3& found, std::uint32_t step) {
    const sim3 truth = T * sim3(s.world.truth(step));
    return (se3(truth.rotation(), truth.translation()).inverse() * found).log().norm();
  };
  CHECK(off(s.front_end.last_pose(s.maps), 9) < 0.05);
  for (std::uint32_t i = 10; i != 14; ++i) {
    CHECK(s.see(i) > 40);
    CHECK(s.front_end.state() == track_state::tracking);
    CHECK(off(s.front_end.last_pose(s.maps), i) < 0.05);
  }
  const trajectory all = s.front_end.log().trajectory(s.maps, 0);
  REQUIRE(all.size() == 7);
  for (std::uint32_t i = 0; i != 7; ++i) CHECK(off(all[i].T_world_camera, i + 7) < 0.05);
}

TEST_CASE("The first two frames of a map without depth both count, and so do their landmarks for the second") {
  scene s({.steps = 60, .density = 60.0, .drift = 0.0, .shrinks = 1e-9});
  s.options = slam::monocular_options(s.options);
  s.options.start.min_matches = 60;
  s.options.initial_pose.reset();
  std::uint32_t step = 0;
  while (step != 6 && s.see(step) == 0) ++step;
  REQUIRE(s.front_end.state() == track_state::tracking);
  const slam::map& m = s.maps.active();
  CHECK(test::validate(m));
  REQUIRE(m.keyframes().size() == 2);
  REQUIRE(m.landmark_count() >= s.options.start.min_points);
  for (const auto& l : m.landmarks()) {
    CHECK(l.created == m.keyframes().back().id);
    CHECK(l.observations.size() == 2);
  }
  CHECK(m.tree().parent(m.keyframes().back().id) == m.keyframes().front().id);
  CHECK(s.front_end.counters().tracked == 2);
  CHECK(s.front_end.log().trajectory(s.maps, 0).size() == 2);
  // One that is begun after the camera was lost takes its first frame from the lost ones.
  s.options.recovery.new_map_after = 0.0;
  s.options.recovery.min_map_keyframes = 2;
  const std::size_t before = s.front_end.counters().frames;
  for (step = 30; step != 50 && s.see(step) == 0;) ++step;
  REQUIRE(s.front_end.state() == track_state::tracking);
  REQUIRE(s.maps.size() == 2);
  CHECK(s.front_end.counters().tracked == 4);
  CHECK(s.front_end.counters().lost == s.front_end.counters().frames - before - 2);
}

TEST_CASE("Where depth is not asked for, the image of it changes nothing") {
  const auto last_pose = [](bool sees_depth) {
    scene s;
    s.options.depth_term.enabled = s.options.depth_term.recovers = false;
    image<float> wall(640, 480);
    for (int v = 0; v != 480; ++v)
      for (int u = 0; u != 640; ++u) wall(u, v) = 2.0F + 0.001F * static_cast<float>(u);
    for (std::uint32_t i = 0; i < 8; ++i) {
      if (sees_depth) s.front_end.depth().set_depth(camera::depth_view<float>{std::as_const(wall).view()});
      CHECK(s.see(i) > 30);
    }
    return s.front_end.last_pose(s.maps);
  };
  CHECK(last_pose(true).to_matrix() == last_pose(false).to_matrix());
}

TEST_CASE("A frame without keypoints is held by the depth of a known corner, and its surface goes with the map") {
  scene s;
  // Walls in the camera frame of step 0, which the camera of step 1 sees from its own place.
  const auto corner_from = [&](const se3& T_first_camera) {
    image<float> depth(640, 480);
    const mat3 turn = T_first_camera.rotation_matrix();
    const std::array<std::pair<vec3, double>, 3> walls{
        {{vec3(0, 0, 1), 2.0}, {vec3(0, 1, 0), 0.5}, {vec3(1, 0, 0.2).normalized(), 0.8}}};
    for (int v = 0; v != 480; ++v)
      for (int u = 0; u != 640; ++u) {
        const vec3 ray = turn * *s.world.camera.unproject(vec2(u, v));
        double nearest = 100.0;
        for (const auto& [normal, distance] : walls) {
          const double z = (distance - normal.dot(T_first_camera.translation())) / normal.dot(ray);
          if (z > 0.0) nearest = std::min(nearest, z);
        }
        depth(u, v) = static_cast<float>(nearest);
      }
    return depth;
  };
  const auto show = [&](const se3& T_first_camera) {
    const image<float> depth = corner_from(T_first_camera);
    s.front_end.depth().set_depth(camera::depth_view<float>{depth.view()});
  };
  show(se3{});
  REQUIRE(s.see(0) > 30);
  const se3 step(so3::exp(vec3(0.02, -0.06, 0.0)), vec3(0.1, 0.02, 0.05));
  show(step);
  CHECK(s.see_nothing(0.5) == 0);
  CHECK(s.front_end.state() == track_state::tracking);
  CHECK((s.front_end.last_pose(s.maps).inverse() * s.world.truth(0) * step).log().norm() < 0.01);
  CHECK(s.maps.active().keyframes().size() == 1);  // nothing that a keyframe needs
  CHECK(s.front_end.counters().lost == 0);
  s.front_end.depth().clear_depth();
  CHECK(s.see_nothing(1.0) == 0);
  CHECK(s.front_end.state() == track_state::lost);
}

TEST_CASE("Where the trajectory is limited, the map forgets erased keyframes that no frame of it hangs on") {
  constexpr std::size_t latest = decltype(scene::front_end)::latest_erased;
  slam::options limited;
  limited.trajectory_frames = 4;
  scene s({.steps = 60, .drift = 0.0}, limited), twin;
  std::uint32_t step = 0;
  const auto walk = [&](std::uint32_t end) {
    for (; step != end; ++step) {
      REQUIRE(s.see(step) > 30);
      REQUIRE(twin.see(step) > 30);
    }
  };
  std::size_t most = 0;
  const auto erase_many = [&](scene& in) {
    slam::map& m = in.maps.active();
    for (int i = 0; i != 5000; ++i) {
      m.erase_keyframe(m.add_keyframe({}));
      in.front_end.forget_erased(in.maps);
      most = std::max(most, m.content().erased.size());
    }
    CHECK((test::validate(m) ? "" : test::validate(m).error().to_string()) == "");
  };
  walk(12);
  const slam::map_keyframe last = s.front_end.last_frame().reference;
  REQUIRE(s.maps.active().keyframes().size() > 1);
  for (scene* in : {&s, &twin}) in->maps.active().erase_keyframe(last.keyframe);

  erase_many(s);
  CHECK(most <= 2 * latest + 1);
  CHECK(s.maps.active().content().forgotten > 5000 - 2 * latest);
  erase_many(twin);
  CHECK(most == 5001);
  CHECK(twin.maps.active().content().forgotten == 0);

  // What frames of the trajectory hang on was erased first, and is remembered.
  CHECK(s.maps.active().remembers(last.keyframe));
  const auto check_alike = [&] {
    CHECK(s.front_end.last_pose(s.maps).to_matrix() == twin.front_end.last_pose(twin.maps).to_matrix());
    const auto all = twin.front_end.log().trajectory(twin.maps, 0), end = s.front_end.log().trajectory(s.maps, 0);
    REQUIRE(end.size() == 4);
    for (std::size_t i = 0; i != 4; ++i)
      CHECK(end[i].T_world_camera.to_matrix() == all[all.size() - 4 + i].T_world_camera.to_matrix());
  };
  check_alike();
  walk(20);
  check_alike();
  REQUIRE(s.front_end.last_frame().reference.keyframe != last.keyframe);
  erase_many(s);
  CHECK_FALSE(s.maps.active().remembers(last.keyframe));
  CHECK(twin.maps.active().remembers(last.keyframe));
  erase_many(twin);
  walk(24);
  check_alike();
}

TEST_CASE("A frame and a surface that hang on a keyframe that was forgotten harm nobody") {
  scene s;
  s.see(0);
  REQUIRE(s.see(1) > 30);
  slam::map& m = s.maps.active();
  const se3 before = s.front_end.last_pose(s.maps);
  const slam::keyframe_id other = m.add_keyframe({});
  const slam::keyframe_id gone = s.front_end.last_frame().reference.keyframe;
  m.erase_keyframe(gone);
  m.forget_erased({}, 0);
  REQUIRE(m.has_keyframe(other));
  REQUIRE_FALSE(m.remembers(gone));
  CHECK(s.front_end.last_pose(s.maps).to_matrix() == before.to_matrix());
  CHECK(s.see(2) > 30);

  slam::detail::surface_memory memory(4);
  std::vector<slam::detail::placed_surface> around;
  slam::detail::surface seen;
  memory.keep({s.maps.active_id(), gone}, se3{}, seen);
  memory.keep({s.maps.active_id(), other}, se3{}, seen);
  memory.around(s.maps, se3{}, 4, around);
  CHECK(around.size() == 1);
}

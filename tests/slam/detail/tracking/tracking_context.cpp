// SPDX-License-Identifier: BSD-3-Clause
#include <utility>

#include <orbis/camera/any.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/slam/detail/tracking/tracking_context.hpp>

#include "slam/ring_world.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

using context =
    slam::detail::tracking_context<camera::any_camera, features::binary_descriptor<256>, slam::orb_matchers>;

/// A context that has tracked steps of a ring, half a second apart, in a map with one keyframe.
struct scene {
  test::ring_world world{{.steps = 60, .drift = 0.0}};
  slam::options options;
  slam::atlas maps{8, 1.2};
  context c{world.rig, options};

  scene() {
    c.state = slam::track_state::tracking;
    slam::frame first = frame(0);
    c.reference = {0, maps.active().add_keyframe(first)};
    add(0);
  }
  [[nodiscard]] slam::frame frame(std::uint32_t step) {
    slam::frame f = world.look(step, world.truth(step));
    f.index = step;
    return f;
  }
  void add(std::uint32_t step) {
    slam::frame f = frame(step);
    const auto anchor = c.refer(f, maps);
    c.set_last(std::move(f), anchor);
  }
};

}  // namespace

TEST_CASE("The motion to a frame is that since the last one and half of its change, if both were tracked") {
  scene s;
  s.add(1);
  const vec6 before = s.c.motion.twist();
  const slam::frame next = s.frame(2);
  const vec6 mean = slam::detail::motion_between(s.c.last, next);
  REQUIRE(s.c.motion_to(next));
  CHECK((*s.c.motion_to(next) - (1.5 * mean - 0.5 * before)).norm() < 1e-12);
  s.c.motion.reset();
  CHECK((*s.c.motion_to(next) - mean).norm() < 1e-12);
  CHECK_FALSE(s.c.motion_to(s.frame(3)));  // not the next one
  slam::frame jumped = next;
  jumped.T_world_camera = se3(so3{}, vec3(100.0, 0.0, 0.0)) * next.T_world_camera;
  CHECK_FALSE(s.c.motion_to(jumped));
  s.c.state = slam::track_state::relocalized;
  CHECK_FALSE(s.c.motion_to(next));
}

TEST_CASE("The last pose follows its keyframe, and the motion its scale") {
  scene s;
  s.add(1);
  const vec6 twist = s.c.motion.twist();
  const se3 before = s.c.last_pose(s.maps);
  CHECK((before.inverse() * s.world.truth(1)).log().norm() < 1e-12);
  const sim3 T(so3::exp(vec3(0.1, 0.2, -0.3)), vec3(1.0, -2.0, 0.5), 2.0);
  s.maps.active().transform(T);
  s.c.follow_maps(s.maps);
  const sim3 moved = T * sim3(before);
  CHECK((s.c.last.T_world_camera.rotation().inverse() * moved.rotation()).angle() < 1e-12);
  CHECK((s.c.last.T_world_camera.translation() - moved.translation()).norm() < 1e-12);
  CHECK((s.c.motion.twist().head<3>() - 2.0 * twist.head<3>()).norm() < 1e-12);
  CHECK((s.c.motion.twist().tail<3>() - twist.tail<3>()).norm() < 1e-12);
}

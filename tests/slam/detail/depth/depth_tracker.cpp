// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/slam/detail/depth/depth_tracker.hpp>

#include "slam/detail/depth/planes.hpp"
#include "support/allocations.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::slam::detail;

namespace {

using descriptor = features::binary_descriptor<256>;

vec6 vector6(double a, double b, double c, double d, double e, double f) {
  vec6 v;
  v << a, b, c, d, e, f;
  return v;
}

/// A map with one keyframe, in the origin of a room.
struct scene {
  slam::camera_rig<camera::pinhole> rig = test::small_rig();
  slam::depth_term_options options;
  std::vector<test::plane> room;
  slam::basic_atlas<descriptor> maps;
  depth_tracker<camera::pinhole> tracker{rig, options};

  explicit scene(std::vector<test::plane> planes) : room{std::move(planes)} {
    slam::basic_frame<descriptor> f;
    const slam::keyframe_id id = maps.active().add_keyframe(f);
    see(se3{});
    CHECK(tracker.needs_surface(maps, se3{}));
    tracker.keep({maps.active_id(), id}, se3{}, vec6::Zero(), {});
  }
  void see(const se3& pose) { tracker.set_depth(test::metres(test::depth_of(room, pose, rig.camera()))); }
  [[nodiscard]] std::optional<depth_alignment> align(const se3& last) {
    if (!tracker.find_surfaces(maps, last)) return std::nullopt;
    return tracker.align(search_starts(last, last, 0.5), {});
  }
};

double pose_error(const se3& a, const se3& b) { return (a.inverse() * b).log().norm(); }

}  // namespace

TEST_CASE("A corner holds the camera after a step of decimetres and ten degrees") {
  scene s{test::corner()};
  const se3 pose(so3::exp(vec3(0.04, -0.18, 0.03)), vec3(0.15, -0.05, 0.12));
  s.see(pose);
  const auto found = s.align(se3{});
  REQUIRE(found);
  CHECK(found->determined == 6);
  CHECK(found->seen.share() > 0.9);
  CHECK(pose_error(found->at.T_world_camera, pose) < 6e-3);
}

TEST_CASE("A wall holds the distance to it and what can be told of the direction, and leaves the rest") {
  scene s{test::wall()};
  const se3 pose(so3::exp(vec3(0.05, -0.1, 0.0)), vec3(0.1, 0.0, 0.15));
  s.see(pose);
  const auto found = s.align(se3{});
  REQUIRE(found);
  CHECK(found->determined == 3);
  const vec3 ahead = found->at.T_world_camera.rotation() * vec3::UnitZ(), truly = pose.rotation() * vec3::UnitZ();
  CHECK((ahead - truly).norm() < 2e-3);
  CHECK(found->at.T_world_camera.translation().z() == Catch::Approx(0.15).margin(2e-3));
}

TEST_CASE("What lies elsewhere is not held") {
  scene s{test::corner()};
  s.room = {{vec3(0.5, 0.5, 0.7).normalized(), 1.2}, {vec3(-0.7, 0.1, 0.7).normalized(), 0.9}};
  s.see(se3{});
  CHECK(!s.align(se3{}));
  s.room.clear();  // no depth
  s.see(se3{});
  CHECK(!s.align(se3{}));
  CHECK(!s.tracker.needs_surface(s.maps, se3{}));
}

TEST_CASE("The term of depth pulls towards the true pose, and is nothing where nothing is known") {
  scene s{test::corner()};
  const se3 pose = se3::exp(vector6(0.05, 0.02, -0.03, 0.02, 0.03, -0.02));
  s.see(pose);
  REQUIRE(s.tracker.find_surfaces(s.maps, pose));
  const se3 off = pose * se3::exp(vector6(0.006, -0.005, 0.004, 0.002, -0.003, 0.002));
  const auto term = s.tracker.term_at({off, vec6::Zero()}, {});
  REQUIRE(term);
  const vec6 step = term->h.topLeftCorner<6, 6>().ldlt().solve(-term->g.head<6>());
  CHECK(pose_error(off * se3::exp(-step), pose) < 0.25 * pose_error(off, pose));
  s.maps.create();
  CHECK(!s.tracker.find_surfaces(s.maps, pose));
}

TEST_CASE("A surface that was read later than the colour is kept as it is at the time of the frame") {
  scene s{test::corner()};
  const vec6 twist = vector6(0.4, -0.2, 0.3, 0.5, -0.6, 0.4);
  const camera::shutter late{.depth_delay = 0.02};
  const se3 pose = se3::exp(vector6(0.3, 0.0, 0.1, 0.0, 0.1, 0.0));
  s.see(pose * se3::exp(0.02 * twist));
  s.tracker.keep({s.maps.active_id(), slam::keyframe_id{0}}, pose, twist, late);
  s.see(pose);
  REQUIRE(s.tracker.find_surfaces(s.maps, pose));
  const moving_pose at{pose, vec6::Zero()};
  const auto kept = s.tracker.term_at(at, {});
  REQUIRE(kept);
  CHECK(s.tracker.agreement(at, {}).share() > 0.95);
  const vec6 step = kept->h.topLeftCorner<6, 6>().ldlt().solve(-kept->g.head<6>());
  CHECK(step.norm() < 1.5e-3);  // of 15 mm
  // And samples are moved likewise.
  s.see(pose * se3::exp(0.02 * twist));
  const auto moved = s.tracker.term_at({pose, twist}, late);
  REQUIRE(moved);
  CHECK(moved->h.topLeftCorner<6, 6>().ldlt().solve(-moved->g.head<6>()).norm() < 1.5e-3);
  CHECK(moved->h.bottomRightCorner<6, 6>().norm() > 0.0);
  // What was read before the colour does not pull at the twist.
  s.see(pose * se3::exp(-0.02 * twist));
  const auto early = s.tracker.term_at({pose, twist}, {.depth_delay = -0.02});
  REQUIRE(early);
  CHECK(early->h.topLeftCorner<6, 6>().ldlt().solve(-early->g.head<6>()).norm() < 1.5e-3);
  CHECK(early->h.rightCols<6>().isZero());
  CHECK(early->h.bottomRows<6>().isZero());
  CHECK(early->g.tail<6>().isZero());
}

TEST_CASE("Depth in the pose allocates nothing once its buffers have grown") {
  scene s{test::corner()};
  const se3 pose = se3::exp(vector6(0.02, 0.02, -0.03, 0.02, 0.03, -0.02));
  const image<float> depth = test::depth_of(s.room, pose, s.rig.camera());
  const auto frame = [&] {
    s.tracker.set_depth(test::metres(depth));
    if (!s.tracker.find_surfaces(s.maps, pose)) return false;
    const bool there = s.tracker.term_at({pose, vec6::Zero()}, {}).has_value();
    return s.tracker.align(search_starts(pose, pose, 0.1), {}).has_value() && there;
  };
  REQUIRE(frame());
  const std::size_t before = test::allocations();
  const bool again = frame();
  const std::size_t after = test::allocations();
  CHECK(again);
  CHECK(after == before);
}

namespace {

se3 at(double x) { return {so3{}, vec3(x, 0.0, 0.0)}; }
surface marked(int step) {
  surface s;
  s.step = step;
  s.cells.resize(1);
  return s;
}

struct remembered {
  slam::basic_atlas<descriptor> maps;
  slam::keyframe_id add(double x) {
    slam::basic_frame<descriptor> f;
    f.T_world_camera = at(x);
    return maps.active().add_keyframe(f);
  }
  slam::map_keyframe key(slam::keyframe_id k) { return {maps.active_id(), k}; }
};

/// Two keyframes a metre apart, each with its surface.
struct two_keyframes : remembered {
  slam::keyframe_id a = add(0.0), b = add(1.0);
  surface_memory memory;
  std::vector<placed_surface> found;

  explicit two_keyframes(std::size_t capacity) : memory{capacity} {
    surface one = marked(1), two = marked(2);
    memory.keep(key(a), se3{}, one);
    memory.keep(key(b), se3{}, two);
  }
};

std::vector<int> steps(const std::vector<placed_surface>& placed) {
  std::vector<int> all;
  for (const placed_surface& p : placed) all.push_back(p.seen->step);
  return all;
}

}  // namespace

TEST_CASE("Surfaces are found by how near they are, and move with their keyframes") {
  two_keyframes s{4};
  surface three = marked(3);
  s.memory.keep(s.key(s.b), at(0.5), three);
  s.memory.around(s.maps, at(0.1), 2, s.found);
  CHECK(steps(s.found) == std::vector{1, 2});
  s.memory.around(s.maps, at(1.4), 3, s.found);
  CHECK(steps(s.found) == std::vector{3, 2, 1});
  CHECK(s.found[0].T_world_camera.translation().x() == Catch::Approx(1.5));
  s.maps.active().set_pose(s.b, at(5.0));
  s.memory.around(s.maps, at(1.4), 3, s.found);
  CHECK(steps(s.found) == std::vector{1, 2, 3});
  CHECK(s.found[2].T_world_camera.translation().x() == Catch::Approx(5.5));
  s.maps.active().erase_keyframe(s.b);  // still placed, relative to what replaced it
  s.memory.around(s.maps, at(5.5), 1, s.found);
  CHECK(steps(s.found) == std::vector{3});
  s.maps.create();
  s.memory.around(s.maps, at(0.0), 3, s.found);
  CHECK(s.found.empty());
}

TEST_CASE("Where there is no room the surface goes that was asked for longest ago") {
  two_keyframes s{2};
  surface three = marked(3);
  s.memory.around(s.maps, at(0.0), 1, s.found);
  CHECK(steps(s.found) == std::vector{1});
  s.memory.keep(s.key(s.b), at(1.0), three);
  CHECK(three.step == 2);  // whose memory is used again
  s.memory.around(s.maps, at(0.0), 4, s.found);
  CHECK(steps(s.found) == std::vector{1, 3});
}

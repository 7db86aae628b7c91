// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "support/catch.hpp"
#include "support/synthetic/building.hpp"
#include "support/synthetic/walk.hpp"

using namespace orbis;
using namespace orbis;
using namespace orbis::io;
using namespace orbis::io::detail::synthetic;
using namespace orbis::test;

static_assert(camera_motion<walk> && camera_motion<posed_path> && camera_motion<camera_path>);

namespace {

double angle_between(const se3& a, const se3& b) { return (a.inverse() * b).rotation().log().norm(); }

}  // namespace

TEST_CASE("a walk leads once round and a little further, and sees the same again") {
  const building_options building;
  const walk way{{}, corridor_corners(building), 3};
  CHECK(way.length_of_round() == Approx(2.0 * (8.4 + 6.4) - 8.0 * 0.9 + 2.0 * 3.14159265 * 0.9));
  CHECK(way.duration() - way.time_of_round() == Approx(2.0 + 0.5));  // half a second to come to rest
  const se3 first = way.at(0.0).T_world_camera(), again = way.at(way.time_of_round()).T_world_camera();
  CHECK((first.translation() - again.translation()).norm() < 0.02);
  CHECK(angle_between(first, again) < 0.04);
  CHECK((way.at(0.5 * way.duration()).T_world_camera().translation() - first.translation()).norm() > 5.0);
}

TEST_CASE("a walk is as fast as asked for, smooth, gentle, and ends at rest") {
  const walk way{{.jitter = 0.0}, corridor_corners({}), 3};
  constexpr double step = 0.05;
  double way_gone = 0.0;
  vec3 last_velocity = vec3::Zero();
  for (double t = 0.0; t < way.duration(); t += step) {
    const se3 a = way.at(t).T_world_camera(), b = way.at(t + step).T_world_camera();
    const vec3 velocity = (b.translation() - a.translation()) / step;
    CHECK(velocity.norm() < 1.15 * 0.6);
    CHECK((velocity - last_velocity).norm() / step < 0.8);
    CHECK(angle_between(a, b) / step < 0.65);
    if (t > 1.0 && t < way.duration() - 1.1) CHECK(velocity.norm() > 0.8 * 0.6);
    way_gone += velocity.norm() * step;
    last_velocity = velocity;
  }
  CHECK(last_velocity.norm() < 0.05);
  CHECK(way_gone == Approx(way.length_of_round() + 2.0 * 0.6).epsilon(0.02));
}

TEST_CASE("a walk keeps clear of all that stands in the corridor") {
  for (std::uint64_t seed = 0; seed != 12; ++seed) {
    const world place = corridor_building({}, seed);
    const walk way{{}, corridor_corners({}), seed};
    for (double t = 0.0; t < way.duration(); t += 0.3)
      CHECK(place.distance(way.at(t).T_world_camera().translation()) > 0.5);
  }
}

TEST_CASE("what is seen at first is out of sight from the first corner to the last") {
  const world place = corridor_building({}, 1);
  const walk way{{.look_aside = -0.35}, corridor_corners({}), 1};
  const camera_pose first = way.at(0.0);
  std::vector<vec3> seen;
  for (int y = -4; y <= 4; ++y)
    for (int x = -5; x <= 5; ++x) {
      const vec3 ray = to_vec3(first.forward + 0.12 * x * first.right + 0.11 * y * first.down);
      const double t = place.cast(to_vec3(first.position), ray).value();
      if (t < 4.5) seen.push_back(to_vec3(first.position) + t * ray);
    }
  REQUIRE(seen.size() > 40);
  const auto visible = [&](double time) {
    const camera_pose pose = way.at(time);
    int count = 0;
    for (const vec3& p : seen) {
      const triple d = to_triple(p) - pose.position;
      const double z = dot(d, pose.forward);
      if (z < 0.1 || std::abs(dot(d, pose.right)) > 0.61 * z || std::abs(dot(d, pose.down)) > 0.46 * z) continue;
      count += place.cast(to_vec3(pose.position), to_vec3(d)).value() > 0.999 ? 1 : 0;
    }
    return count;
  };
  CHECK(visible(0.0) > 0.9 * static_cast<double>(seen.size()));
  for (double share = 0.3; share < 0.8; share += 0.01) CHECK(visible(share * way.time_of_round()) == 0);
  CHECK(visible(way.time_of_round()) > 0.8 * static_cast<double>(seen.size()));
}

TEST_CASE("given poses are kept, and joined evenly") {
  const walk way{{}, corridor_corners({}), 2};
  trajectory poses;
  for (int i = 0; i != 60; ++i) poses.push_back({100.0 + 0.1 * i, way.at(0.1 * i).T_world_camera()});
  const posed_path path{poses};
  CHECK(path.duration() == Approx(5.9));
  for (int i = 0; i != 60; ++i)
    CHECK(
        (path.at(0.1 * i).T_world_camera().inverse() * poses[static_cast<std::size_t>(i)].T_world_camera).log().norm() <
        1e-6);
  const se3 middle = path.at(2.05).T_world_camera();
  CHECK((middle.translation() - 0.5 * (poses[20].T_world_camera.translation() + poses[21].T_world_camera.translation()))
            .norm() < 1e-9);
  CHECK(angle_between(poses[20].T_world_camera, middle) == Approx(angle_between(middle, poses[21].T_world_camera)));
  CHECK((path.at(-1.0).T_world_camera().translation() - poses.front().T_world_camera.translation()).norm() == 0.0);
  CHECK((path.at(99.0).T_world_camera().translation() - poses.back().T_world_camera.translation()).norm() == 0.0);
}

TEST_CASE("whoever crosses the view goes from one side of it to the other") {
  const walk way{{}, corridor_corners({}), 2};
  const auto steps = way_across(way, {.begin = 5.0, .end = 8.0});
  REQUIRE(steps.size() == 31);
  CHECK(steps.front().time == 5.0);
  CHECK(steps.back().time == Approx(8.0));
  double last = -10.0;
  for (const whereabouts& w : steps) {
    const camera_pose pose = way.at(w.time);
    const double right = dot(w.position - pose.position, pose.right);
    CHECK(w.position.z == 0.0);
    CHECK(right > last);
    last = right;
  }
  CHECK(last == Approx(1.1).margin(0.1));
}

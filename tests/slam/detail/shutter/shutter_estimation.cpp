// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/slam/detail/shutter/shutter_estimation.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::slam::detail;

namespace {

const slam::camera_rig<camera::pinhole> rig{{{640, 480, 525.0, 525.0, 319.5, 239.5}, 400.0}, {}, 0.1, 10.0};

vec6 random_motion(random_bits& random, double scale) {
  vec6 twist;
  for (int i = 0; i != 6; ++i) twist[i] = scale * random.normal();
  return twist;
}

/// A view of a wavy wall by a moving camera whose depth image is late.
row_view seen(const se3& pose, const vec6& twist, const camera::shutter& is, double noise, random_bits& random) {
  const auto depth_of = [](const vec3& p) { return 2.0 + 0.4 * p.x() - 0.3 * p.y(); };  // in the world: z of the wall
  row_view v;
  v.T_world_camera = pose;
  v.twist = twist;
  for (std::uint32_t id = 0; id != 150; ++id) {
    random_bits place{id};
    vec3 p(place.uniform(-0.9, 0.9), place.uniform(-0.7, 0.7), 0.0);
    p.z() = depth_of(p);
    const vec3 q = pose.inverse() * p;
    vec3 then = q;
    for (int k = 0; k != 20; ++k) then = se3::exp(-is.color_time(rig.camera().project(then)->y(), 480) * twist) * q;
    const vec2 at = *rig.camera().project(then) + noise * vec2(random.normal(), random.normal());
    const vec3 ray = *rig.camera().unproject(at);
    const double row = is.color_time(at.y(), 480);
    // What the depth image would give for an assumed delay: its true depth at where the point is believed to be.
    const auto read = [&](double assumed) {
      const vec3 there = se3::exp(-assumed * twist) * then;
      const vec3 direction = there / there.z();
      const se3 T_world_late = pose * se3::exp((row + is.depth_delay) * twist);
      const vec3 d = T_world_late.rotation() * direction, c = T_world_late.translation();
      const double z = (2.0 + 0.4 * c.x() - 0.3 * c.y() - c.z()) / (d.z() - 0.4 * d.x() + 0.3 * d.y());
      return static_cast<float>(then.z() + z - there.z() + 0.005 * noise * random.normal());
    };
    const float now = read(0.0);
    v.read.push_back({ray.x(),
                      ray.y(),
                      static_cast<float>(at.x()),
                      static_cast<float>(at.y()),
                      now,
                      now,
                      {read(slam::depth_change::step) - now, read(-slam::depth_change::step) - now}});
    v.landmarks.emplace_back(id);
    v.information.push_back(1.0);
  }
  return v;
}

void forget_changes(row_view& v) {
  for (slam::keypoint_as_read& k : v.read) k.change = {};
}

slam::shutter_estimate estimate(const camera::shutter& is, double motion, double noise, bool with_depth = true,
                                const camera::shutter& assumed = {}) {
  random_bits random{5};
  shutter_estimator estimator;
  for (std::uint32_t k = 0; k != 12; ++k) {
    const row_view from = seen(se3::exp(random_motion(random, 0.02)), random_motion(random, motion), is, noise, random);
    for (int i = 0; i != 4; ++i) {
      row_view to = seen(se3::exp(random_motion(random, 0.02)), random_motion(random, motion), is, noise, random);
      if (!with_depth) forget_changes(to);
      row_view before = from;
      if (!with_depth) forget_changes(before);
      const auto e = build_shutter_equations(before, to, rig, camera::shutter{});
      REQUIRE(e);
      estimator.add({0, slam::keyframe_id{k}}, *e);
    }
  }
  return estimator.estimate(assumed);
}

}  // namespace

TEST_CASE("Read-out and delay are found from pairs of views, with their deviations") {
  const auto found = estimate({.color_read_out = 0.02, .depth_read_out = 0.02, .depth_delay = 0.01}, 0.4, 0.3);
  CHECK(std::abs(found.shutter.color_read_out - 0.02) < 0.001);
  CHECK(found.shutter.depth_read_out == found.shutter.color_read_out);
  CHECK(std::abs(found.shutter.depth_delay - 0.01) < 0.002);
  CHECK(found.read_out_deviation < 0.001);
  CHECK(found.delay_deviation < 0.002);
  CHECK(found.delay_deviation > 0.1 * found.delay);  // includes the error of the velocity
}

TEST_CASE("A global shutter is found to be one") {
  const auto found = estimate({}, 0.4, 0.5);
  CHECK(found.shutter.is_global());
  CHECK(std::abs(found.read_out) < 5.0 * found.read_out_deviation);
  CHECK(found.read_out_deviation < 0.001);
}

TEST_CASE("A camera that hardly moves does not tell") {
  const auto found = estimate({.color_read_out = 0.02, .depth_read_out = 0.02}, 0.005, 0.5);
  CHECK(found.shutter.is_global());
  CHECK(found.read_out_deviation > 0.002);
}

TEST_CASE("What is assumed is kept if the estimate is insignificant and agrees") {
  const camera::shutter is{.color_read_out = 0.02, .depth_read_out = 0.02}, wrong{.color_read_out = 0.06};
  const auto vague = estimate(is, 0.002, 0.5, true, is);
  CAPTURE(vague.read_out, vague.read_out_deviation, vague.delay, vague.delay_deviation);
  CHECK(vague.shutter == is);
  CHECK(estimate({}, 0.4, 0.5, true, wrong).shutter.is_global());
}

TEST_CASE("Without depth the read-out alone is found") {
  const auto found = estimate({.color_read_out = 0.02, .depth_read_out = 0.02}, 0.4, 0.3, false);
  CHECK(std::abs(found.shutter.color_read_out - 0.02) < 0.001);
  CHECK(found.shutter.depth_delay == 0.0);
  CHECK(std::isinf(found.delay_deviation));
}

TEST_CASE("Nothing is said of too few keyframes, and views that share little have no equations") {
  random_bits random{1};
  row_view a = seen(se3{}, random_motion(random, 0.3), {}, 0.3, random), b = a;
  const auto e = build_shutter_equations(a, b, rig, {});
  REQUIRE(e);
  shutter_estimator estimator;
  for (std::uint32_t k = 0; k != 7; ++k) estimator.add({0, slam::keyframe_id{k}}, *e);
  CHECK(std::isinf(estimator.estimate().read_out_deviation));
  CHECK(estimator.estimate({.color_read_out = 0.01}).shutter.color_read_out == 0.01);
  for (std::size_t i = 20; i != b.landmarks.size(); ++i) b.landmarks[i] = slam::no_id;
  CHECK_FALSE(build_shutter_equations(a, b, rig, {}));
}

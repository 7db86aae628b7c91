// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/random.hpp>
#include <orbis/slam/detail/dynamics/motion_split.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

using splitter = slam::detail::motion_splitter<camera::pinhole>;

/// A room of 120 points, and a body of 150 before it that has moved by `motion` since its points were known.
struct scene {
  optimize::reprojection<camera::pinhole> model{camera::pinhole{camera::intrinsics{640, 480, 525, 525, 319.5, 239.5}},
                                                400.0};
  slam::moving_options options;
  std::vector<optimize::pose_observation> observations;
  std::vector<double> trust;
  std::size_t room = 120, body = 150;
  se3 truth{so3::exp(vec3(0.01, -0.02, 0.0)), vec3(0.02, 0.0, 0.01)};
  se3 carried;  ///< where the camera would be if the body stood still

  explicit scene(const vec3& motion, double trust_of_room = 1.0) {
    random_bits bits{7};
    const se3 moved{so3{}, motion};
    carried = moved.inverse() * truth;
    const auto add = [&](const vec3& known, const vec3& now, double t) {
      const vec3 seen = truth.inverse() * now;
      const auto pixel = model.camera.project(seen);
      if (!pixel) return false;
      optimize::pose_observation o;
      o.point = known;
      const double noise_y = bits.uniform(-0.7, 0.7);  // one after the other: arguments have no order
      const double noise_x = bits.uniform(-0.7, 0.7);
      o.pixel = *pixel + vec2(noise_x, noise_y);
      o.right = model.right(o.pixel.x(), seen.z());
      o.information = 1.0;
      observations.push_back(o);
      trust.push_back(t);
      return true;
    };
    while (observations.size() < room) {
      const double z = bits.uniform(2.0, 4.0), y = bits.uniform(-1.0, 1.0), x = bits.uniform(-1.5, 1.5);
      const vec3 p(x, y, z);
      add(p, p, trust_of_room);
    }
    while (observations.size() < room + body) {
      const double z = bits.uniform(0.9, 1.1), y = bits.uniform(-0.4, 0.4), x = bits.uniform(-0.3, 0.3);
      const vec3 p(x, y, z);
      add(p, moved * p, 0.0);
    }
  }
  [[nodiscard]] std::vector<std::uint8_t> outliers_at(const se3& pose) const {
    std::vector<std::uint8_t> out(observations.size());
    const auto judged = optimize::refine_pose(std::span<const optimize::pose_observation>(observations), model, pose,
                                              std::span<std::uint8_t>(out), {.rounds = 0});
    CHECK(judged.inliers > 0);
    return out;
  }
  [[nodiscard]] auto split(const se3& fitted) const {
    return splitter::split(observations, trust, model, truth, fitted, outliers_at(fitted), options, 1);
  }
  [[nodiscard]] double error(const se3& pose) const { return (truth.inverse() * pose).log().norm(); }
};

}  // namespace

TEST_CASE("The camera's motion is that of what was there before and is spread wide") {
  for (const double trust : {1.0, 0.0}) {  // the second time nothing is older than the rest
    const scene s(vec3(0.05, 0.0, 0.01), trust);
    const auto found = s.split(s.carried);  // the body has more points, and carried the pose along
    REQUIRE(found);
    CHECK(s.error(found->T_world_camera) < 0.003);
    CHECK(found->by_trust == (trust == 1.0));
    std::size_t in_room = 0, on_body = 0;
    for (std::size_t i = 0; i != s.observations.size(); ++i) (i < s.room ? in_room : on_body) += found->moving[i];
    CHECK(in_room == 0);
    CHECK(on_body > s.body * 9 / 10);
    CHECK(found->inliers > s.room * 9 / 10);
  }
}

TEST_CASE("What moves is found where the pose is right already, which then stays as it is") {
  const scene s(vec3(0.05, 0.0, 0.01), 0.0);
  const auto found = s.split(s.truth);
  REQUIRE(found);
  CHECK(s.error(found->T_world_camera) == 0.0);
  CHECK(std::count(found->moving.begin(), found->moving.end(), 1) > 130);
}

TEST_CASE("Nothing moves where the outliers have no motion in common or lie among what stands still") {
  scene still(vec3::Zero());
  random_bits bits{3};
  for (std::size_t i = 0; i < still.observations.size(); i += 3) {
    const double y = bits.uniform(-20.0, 20.0), x = bits.uniform(-20.0, 20.0);
    still.observations[i].pixel += vec2(x, y);
  }
  CHECK(!still.split(still.truth));
  scene shaken(vec3::Zero());  // every third point is seen elsewhere, all alike
  for (std::size_t i = 0; i < shaken.observations.size(); i += 3) shaken.observations[i].pixel.x() += 8.0;
  const auto found = shaken.split(shaken.truth);
  CHECK((!found || std::count(found->moving.begin(), found->moving.end(), 1) == 0));
}

TEST_CASE("A closer look is taken where many disagree, or where what is new draws the pose along") {
  const slam::moving_options o;
  CHECK(slam::detail::may_hold_two_motions(200, 160, o));
  CHECK(!slam::detail::may_hold_two_motions(200, 175, o));
  CHECK(!slam::detail::may_hold_two_motions(60, 45, o));
  const auto drawn = [](const scene& s) {
    std::vector<std::uint8_t> out(s.observations.size());
    const auto all = optimize::refine_pose(std::span<const optimize::pose_observation>(s.observations), s.model,
                                           s.truth, std::span<std::uint8_t>(out));
    return splitter::is_biased_by_motion(s.observations, s.trust, s.model, all.T_world_camera, s.options);
  };
  CHECK(drawn(scene(vec3(0.009, 0.0, 0.0))));
  CHECK(!drawn(scene(vec3::Zero())));
  CHECK(!drawn(scene(vec3(0.009, 0.0, 0.0), 0.0)));  // nobody can tell
}

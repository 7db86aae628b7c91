// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/slam/detail/loops/loop_verification.hpp>

#include "slam/at_once.hpp"
#include "slam/ring_world.hpp"
#include "support/catch.hpp"

using namespace orbis;
using slam::detail::loop_verdict;

namespace {

[[nodiscard]] double apart(const se3& a, const se3& b) { return (a.inverse() * b).translation().norm(); }
[[nodiscard]] double turned(const se3& a, const se3& b) { return (a.rotation().inverse() * b.rotation()).log().norm(); }

}  // namespace

TEST_CASE("A place seen again is recognised, and where it is seen from") {
  test::ring_world world;
  const slam::map m = world.round(4);
  const slam::keyframe_id last = m.keyframes().back().id;
  REQUIRE(last == 103);
  for (const std::uint32_t candidate : {2U, 3U, 5U}) {
    const auto check = test::verify_loop(m, last, m, candidate, world.rig);
    CHECK(to_string(check.verdict) == "accepted");
    REQUIRE(check);
    const se3 truth = world.truth(candidate).inverse() * world.truth(last.value());
    CHECK(apart(check.match.T_candidate_keyframe, truth) < 0.03);  // the map is bent between the landmarks, too
    CHECK(turned(check.match.T_candidate_keyframe, truth) < 0.01);
    const se3 drifted = m.at(candidate).T_world_camera.inverse() * m.at(last).T_world_camera;
    CHECK(apart(drifted, truth) > 0.2);
    CHECK(check.match.keyframe == last);
    CHECK(check.match.candidate == candidate);
    CHECK(check.match.supporters == 2);
    CHECK(check.match.inliers >= 40);
    REQUIRE(check.match.inliers == check.match.matches.size());
    for (const auto& [feature, l] : check.match.matches) {  // each is the point that the keypoint shows
      const auto& by = m.landmark_at(l).observations.front();
      CHECK(world.point_of(last, feature) == world.point_of(by.keyframe, by.feature));
    }
    const auto again = test::verify_loop(m, last, m, candidate, world.rig);
    CHECK(again.match.T_candidate_keyframe.to_matrix() == check.match.T_candidate_keyframe.to_matrix());
    CHECK(again.match.matches == check.match.matches);
  }
}

TEST_CASE("Without drift, where a place is seen from is known to millimetres") {
  test::ring_world world({.drift = 0.0});
  const slam::map m = world.round(4);
  const auto check = test::verify_loop(m, 103, m, 3, world.rig);
  REQUIRE(check);
  CHECK(apart(check.match.T_candidate_keyframe, world.truth(3).inverse() * world.truth(103)) < 0.004);
  // 1.2 cm of noise at 2 m, in 150 points over 2.4 m: 1.4 mrad about each axis.
  CHECK(turned(check.match.T_candidate_keyframe, world.truth(3).inverse() * world.truth(103)) < 0.004);
}

TEST_CASE("The candidate may be one of another map, in a frame of its own") {
  test::ring_world world;
  slam::map first(8, 1.2), second(8, 1.2);
  const se3 elsewhere(so3::exp(vec3(0.3, -1.0, 2.0)), vec3(10, -20, 3));
  world.walk(first, 0, 10, world.truth(0));
  world.walk(second, 5, 15, elsewhere * world.truth(5));
  const auto check = test::verify_loop(second, 2, first, 8, world.rig);  // steps 7 and 8
  REQUIRE(check);
  CHECK(apart(check.match.T_candidate_keyframe, world.truth(8).inverse() * world.truth(7)) < 0.03);
}

TEST_CASE("Another place that looks just the same is refused for the drift it would take") {
  test::ring_world world({.symmetry = 2});  // all looks the same half a round further
  slam::map m(8, 1.2);
  world.walk(m, 0, 54, world.truth(0));
  const auto check = test::verify_loop(m, 53, m, 3, world.rig);
  CHECK(to_string(check.verdict) == "too far");
  CHECK(check.match.inliers >= 40);  // by its looks it is the same place
  CHECK(check.match.supporters == 2);
  slam::loop_options trusting;
  trusting.max_translation = 100.0;
  trusting.max_rotation = 4.0;
  CHECK(test::verify_loop(m, 53, m, 3, world.rig, trusting));
}

TEST_CASE("What does not look alike, is not rigid, or too little, is no loop") {
  test::ring_world world;
  const slam::map m = world.round(4);
  const auto verdict = [&](const slam::map& in, slam::keyframe_id candidate, const slam::loop_options& o = {}) {
    return test::verify_loop(in, 103, in, candidate, world.rig, o).verdict;
  };
  CHECK(verdict(m, 102) == loop_verdict::connected);
  CHECK(verdict(m, 50) == loop_verdict::few_matches);
  slam::loop_options strict;
  strict.min_inliers = 5000;
  CHECK(verdict(m, 3, strict) == loop_verdict::few_inliers);

  // The same, but the neighbours of the keyframe show something else.
  auto content = m.content();
  for (slam::keyframe_id k = 80; k < 103; ++k)
    for (auto& d : content.keyframes[k].features.descriptors)
      for (auto& w : d.words) w = ~w;
  CHECK(verdict(slam::map(content), 3) == loop_verdict::not_supported);

  // The keypoints of the keyframe show the same points, but these are mixed up in space.
  content = m.content();
  random_bits random(3);
  for (auto& z : content.keyframes[103].depth) z = static_cast<float>(random.uniform(0.5, 8.0));
  for (auto& ray : content.keyframes[103].rays) ray = vec3(random.uniform(-0.6, 0.6), random.uniform(-0.4, 0.4), 1.0);
  CHECK(verdict(slam::map(content), 3) == loop_verdict::not_aligned);

  // Nothing there at all.
  slam::map with_nothing = m;
  with_nothing.add_keyframe({});
  CHECK(test::verify_loop(with_nothing, 104, with_nothing, 3, world.rig).verdict == loop_verdict::few_matches);
  CHECK(test::verify_loop(with_nothing, 103, with_nothing, 104, world.rig).verdict == loop_verdict::few_matches);
}

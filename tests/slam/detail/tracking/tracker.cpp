// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/slam/detail/tracking/tracker.hpp>

#include "slam/ring_world.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

using descriptor = features::binary_descriptor<256>;

/// A map of ten keyframes without drift, and the frame that follows.
struct scene {
  test::ring_world world{{.steps = 60, .drift = 0.0}};
  slam::options options;
  slam::map m{8, 1.2};
  slam::detail::tracker<camera::any_camera, descriptor, slam::orb_matchers> tracker{world.rig, options};
  slam::detail::moving_features<camera::any_camera, descriptor, slam::orb_matchers> moving{world.rig, options};
  slam::frame next;

  scene() {
    world.walk(m, 0, 10, world.truth(0));
    next = world.look(10, se3{});
  }
  [[nodiscard]] double error() const { return (world.truth(10).inverse() * next.T_world_camera).log().norm(); }
  /// Landmarks of the frame that are not the points that its keypoints show.
  [[nodiscard]] std::size_t wrong_landmarks() const {
    std::size_t wrong = 0;
    for (std::uint32_t i = 0; i < next.size(); ++i) {
      if (next.landmarks[i] == slam::no_id) continue;
      const auto& o = m.landmark_at(next.landmarks[i]).observations.front();
      wrong += world.point_of(o.keyframe, o.feature) != world.point_of(10U, i);
    }
    return wrong;
  }
};

}  // namespace

TEST_CASE("A frame is found from the last one and a rough prediction") {
  scene s;
  const slam::frame& last = s.m.at(9);
  const se3 predicted = s.world.truth(10) * se3(so3::exp(vec3(0.004, -0.004, 0.004)), vec3(0.01, 0.01, -0.01));
  CHECK(s.tracker.by_motion(s.next, s.m, last, predicted, s.moving) > 50);
  CHECK(s.error() < 0.01);
  CHECK(s.wrong_landmarks() == 0);
  CHECK(s.tracker.by_motion(s.next, s.m, last, s.world.truth(40), s.moving) == 0);  // looks at another wall
}

TEST_CASE("Points of the last frame that have no landmark are found by their depth") {
  scene s;
  slam::frame last = s.m.at(9);
  last.landmarks.assign(last.size(), slam::no_id);
  CHECK(s.tracker.by_motion(s.next, s.m, last, s.world.truth(10), s.moving) > 50);
  CHECK(s.error() < 0.01);
  CHECK(std::set(s.next.landmarks.begin(), s.next.landmarks.end()).size() == 1);  // none
}

TEST_CASE("A frame is found by its appearance, without any prediction") {
  scene s;
  s.next.T_world_camera = s.world.truth(30);
  CHECK(s.tracker.by_appearance(s.next, s.m, 9) > 50);
  CHECK(s.error() < 0.01);
  CHECK(s.wrong_landmarks() == 0);
  slam::frame elsewhere = s.world.look(35, se3{});
  CHECK(s.tracker.by_appearance(elsewhere, s.m, 9) == 0);
}

TEST_CASE("A frame is found from the last one when the camera has turned far") {
  scene s;
  slam::frame last = s.m.at(9);
  const vec3 turn = GENERATE(vec3(0.0, 0.3, 0.0), vec3(0.15, -0.35, 0.0), vec3(-0.2, 0.0, 0.05));
  last.T_world_camera = s.world.truth(10) * se3(so3::exp(turn), vec3(0.05, -0.05, 0.02));  // as if it had looked there
  CHECK(s.tracker.by_motion(s.next, s.m, last, last.T_world_camera, s.moving) == 0);
  CHECK(s.tracker.by_turning(s.next, s.m, last) > 50);
  CHECK(s.error() < 0.01);
  CHECK(s.wrong_landmarks() == 0);
  last.T_world_camera = s.world.truth(40);  // another wall
  CHECK(s.tracker.by_turning(s.next, s.m, last) == 0);
}

TEST_CASE("The local map adds landmarks that the last frame did not show") {
  scene s;
  s.next.T_world_camera = s.world.truth(10);
  std::set<slam::landmark_id> expected, found;
  const std::size_t inliers = s.tracker.on_local_map(
      s.next, s.m, 9, 4.0, s.moving, [&](slam::landmark_id l) { expected.insert(l); },
      [&](slam::landmark_id l) { found.insert(l); });
  CHECK(inliers > 100);
  CHECK(inliers == found.size());
  CHECK(expected.size() > found.size());
  for (const auto l : found) CHECK(expected.contains(l));
  CHECK(s.error() < 0.005);
  CHECK(s.wrong_landmarks() == 0);
}

namespace {

/// A frame, and all points that its keypoints show, as landmarks with the number of their keypoint.
struct matched_scene {
  test::ring_world world{{.steps = 60}};
  slam::frame f = world.look(10, world.truth(10));
  slam::detail::search_list<descriptor> list;
  std::vector<features::match> matches;

  matched_scene() {
    for (std::uint32_t i = 0; i != f.size(); ++i) {
      list.add({world.point(world.point_of(10U, i)), i}, {}, {}, {});
      matches.push_back({i, i, 0});
    }
  }
  [[nodiscard]] double error() const { return (world.truth(10).inverse() * f.T_world_camera).log().norm(); }
};

}  // namespace

TEST_CASE("A frame gets the pose that its matches agree on, and the landmarks that agree with it") {
  matched_scene s;
  s.f.T_world_camera = s.world.truth(10) * se3(so3::exp(vec3(0.01, -0.01, 0.02)), vec3(0.02, 0.01, -0.02));
  s.list.points[3].position += vec3(0.0, 0.0, 0.7);  // a wrong match
  const std::size_t inliers = slam::detail::refine_on_matches<descriptor>(s.f, s.list, s.matches, s.world.rig);
  CHECK(inliers > s.f.size() * 8 / 10);
  CHECK(s.error() < 0.005);
  CHECK(s.f.landmarks[3] == slam::no_id);
  std::size_t known = 0;
  for (std::uint32_t i = 0; i != s.f.size(); ++i) {
    known += s.f.landmarks[i] != slam::no_id;
    CHECK((s.f.landmarks[i] == slam::no_id || s.f.landmarks[i] == i));
  }
  CHECK(known == inliers);
}

TEST_CASE("Too few matches leave a frame with its pose and without landmarks") {
  matched_scene s;
  s.f.landmarks[0] = 3;
  s.matches.resize(2);
  CHECK(slam::detail::refine_on_matches<descriptor>(s.f, s.list, s.matches, s.world.rig) == 0);
  CHECK(s.error() == 0.0);
  CHECK(s.f.landmarks[0] == slam::no_id);
}

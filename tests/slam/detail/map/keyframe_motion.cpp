// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <set>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/slam/detail/loops/essential_graph.hpp>
#include <orbis/slam/detail/map/keyframe_motion.hpp>

#include "slam/random_map.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

[[nodiscard]] double distance(const se3& a, const se3& b) { return (a.inverse() * b).log().norm(); }

}  // namespace

TEST_CASE("In another frame of reference every keyframe sees what it saw") {
  random_bits random(1);
  const slam::map before = test::random_map(2, 1500);
  slam::map m = before;
  const se3 T = test::random_motion(random);
  slam::detail::transform(m, T);
  for (const auto& l : m.landmarks()) {
    const auto& old = before.landmark_at(l.id);
    CHECK((l.normal - T.rotation() * old.normal).norm() < 1e-12);
    for (const auto& o : l.observations)
      CHECK((m.at(o.keyframe).T_world_camera.inverse() * l.position -
             before.at(o.keyframe).T_world_camera.inverse() * old.position)
                .norm() < 1e-9);
  }
  for (slam::keyframe_id k = 0; k != m.keyframe_end(); ++k) CHECK(distance(m.pose_of(k), T * before.pose_of(k)) < 1e-9);
  CHECK(test::fault_of(m) == "");
}

TEST_CASE("A neighbourhood moves with what it sees, and nothing else does") {
  random_bits random(3);
  const slam::map before = test::random_map(4, 1500, 25, 12);
  slam::map m = before;
  const auto around = slam::detail::neighborhood(m, m.keyframes().back().id);
  REQUIRE(around.size() > 1);
  REQUIRE(around.size() < m.keyframes().size());
  const se3 T = test::random_motion(random);
  slam::detail::transform(m, around, T);
  const std::set<slam::keyframe_id> moved(around.begin(), around.end());
  for (const auto& k : before.keyframes())
    CHECK(distance(m.at(k.id).T_world_camera, moved.contains(k.id) ? T * k.T_world_camera : k.T_world_camera) < 1e-9);
  std::size_t stayed = 0;
  for (const auto& l : before.landmarks()) {
    bool seen = false;
    for (const auto& o : l.observations) seen = seen || moved.contains(o.keyframe);
    stayed += !seen;
    CHECK((m.landmark_at(l.id).position - (seen ? T * l.position : l.position)).norm() < 1e-9);
  }
  CHECK(stayed > 0);
}

TEST_CASE("Landmarks go with the oldest of the keyframes that are moved") {
  random_bits random(5);
  const slam::map before = test::random_map(6, 1500, 25);
  slam::map m = before;
  std::vector<slam::keyframe_id> moved;
  for (const auto& k : m.keyframes())
    if (k.id % 3 != 0) moved.insert(moved.begin(), k.id);  // in any order
  std::vector<se3> poses;
  for (std::size_t i = 0; i < moved.size(); ++i) poses.push_back(test::random_motion(random));
  slam::detail::move_keyframes(m, moved, poses);
  for (std::size_t i = 0; i < moved.size(); ++i) CHECK(distance(m.at(moved[i]).T_world_camera, poses[i]) < 1e-12);
  for (const auto& l : before.landmarks()) {
    const auto by =
        std::find_if(l.observations.begin(), l.observations.end(), [](const auto& o) { return o.keyframe % 3 != 0; });
    if (by == l.observations.end()) {
      CHECK(m.landmark_at(l.id).position == l.position);
    } else {
      CHECK((m.at(by->keyframe).T_world_camera.inverse() * m.landmark_at(l.id).position -
             before.at(by->keyframe).T_world_camera.inverse() * l.position)
                .norm() < 1e-9);
    }
  }
}

TEST_CASE("All keyframes at once move as one by one; landmarks may be updated part by part") {
  random_bits random(7);
  slam::map one = test::random_map(8, 1500, 25), all = one;
  std::vector<se3> motion, poses;
  std::vector<slam::keyframe_id> moved;
  for (slam::keyframe_id k = 0; k != one.keyframe_end(); ++k) motion.push_back(test::random_motion(random));
  for (const auto& k : one.keyframes()) {
    moved.push_back(k.id);
    poses.push_back(motion[k.id] * k.T_world_camera);
  }
  slam::detail::move_keyframes(one, moved, poses);
  slam::detail::move_all(all, motion);
  for (const auto& k : one.keyframes()) CHECK(distance(all.at(k.id).T_world_camera, k.T_world_camera) < 1e-12);
  for (const auto& l : one.landmarks()) CHECK((all.landmark_at(l.id).position - l.position).norm() < 1e-9);

  slam::map parts = all;
  CHECK_FALSE(slam::detail::update_landmarks(all, 0, all.landmark_end()));
  slam::landmark_id at = 0;
  std::size_t steps = 1;
  for (; slam::detail::update_landmarks(parts, at, 100); at += 100) ++steps;
  CHECK(steps == (parts.landmark_end() + 99) / 100);
  CHECK_FALSE(slam::detail::update_landmarks(parts, parts.landmark_end() + 5, 100));
  for (const auto& l : all.landmarks()) {
    CHECK(parts.landmark_at(l.id).normal == l.normal);
    CHECK(parts.landmark_at(l.id).max_distance == l.max_distance);
  }
}

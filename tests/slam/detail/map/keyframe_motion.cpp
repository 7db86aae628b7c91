// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/slam/detail/loops/loop_correction.hpp>
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
  m.transform(sim3(T));
  for (const auto& l : m.landmarks()) {
    const auto& old = before.landmark_at(l.id);
    CHECK((l.normal - T.rotation() * old.normal).norm() < 1e-12);
    for (const auto& o : l.observations)
      CHECK((m.at(o.keyframe).T_world_camera.inverse() * l.position -
             before.at(o.keyframe).T_world_camera.inverse() * old.position)
                .norm() < 1e-9);
  }
  for (slam::keyframe_id k = 0; k != m.keyframe_end(); ++k) CHECK(distance(m.pose(k), T * before.pose(k)) < 1e-9);
  CHECK(test::fault_of(m) == "");
}

TEST_CASE("A neighbourhood is a keyframe and its neighbours in the covisibility graph") {
  const slam::map m = test::random_map(4, 1500, 25, 12);
  const slam::keyframe_id last = m.keyframes().back().id;
  const auto around = slam::detail::neighborhood(m, last);
  REQUIRE(around.size() > 1);
  REQUIRE(around.size() < m.keyframes().size());
  CHECK(around.front() == last);
  for (std::size_t i = 1; i != around.size(); ++i) CHECK(m.covisibility().connected(last, around[i]));
}

TEST_CASE("All keyframes move, landmarks with the oldest one that observes them, these may be updated part by part") {
  random_bits random(7);
  const slam::map before = test::random_map(8, 1500, 25);
  slam::map all = before;
  slam::detail::keyframe_motions motion;
  for (const auto& k : before.keyframes()) {
    const se3 T = test::random_motion(random);
    const double scale = k.id.value() % 2 == 0 ? 1.0 : random.uniform(0.5, 2.0);
    motion.emplace(k.id.value(), sim3(T.rotation(), T.translation(), scale));
  }
  slam::detail::move_all(all, motion);
  for (const auto& k : before.keyframes()) {
    const sim3 expected = motion.at(k.id.value()) * sim3(k.T_world_camera);
    CHECK(distance(all.at(k.id).T_world_camera, se3(expected.rotation(), expected.translation())) < 1e-12);
    CHECK(all.scale(k.id) == motion.at(k.id.value()).scale());
  }
  for (const auto& l : before.landmarks()) {
    const auto oldest = l.observations.front().keyframe;
    CHECK((all.at(oldest).T_world_camera.inverse() * all.landmark_at(l.id).position -
           motion.at(oldest.value()).scale() * (before.at(oldest).T_world_camera.inverse() * l.position))
              .norm() < 1e-9);
  }

  slam::map parts = all;
  slam::detail::update_landmarks(all, 0, all.landmark_count());
  slam::landmark_id at = 0;
  std::size_t steps = 0;
  for (; at != parts.landmark_end(); ++steps) at = slam::detail::update_landmarks(parts, at, 100);
  CHECK(steps == (parts.landmark_count() + 99) / 100);
  CHECK(slam::detail::update_landmarks(parts, parts.landmark_end(), 100) == parts.landmark_end());
  for (const auto& l : all.landmarks()) {
    CHECK(parts.landmark_at(l.id).normal == l.normal);
    CHECK(parts.landmark_at(l.id).max_distance == l.max_distance);
  }
}

TEST_CASE("Keyframes without a new pose move with their parent in the tree") {
  random_bits random(9);
  slam::map m = test::random_map(10, 1500, 25);
  std::vector<slam::keyframe_id> solved;
  std::vector<sim3> poses;
  for (const auto& k : m.keyframes())
    if (k.id.value() % 3 == 0) {
      solved.push_back(k.id);
      const se3 T = test::random_motion(random);
      poses.emplace_back(T.rotation(), T.translation(), random.uniform(0.5, 2.0));
    }
  REQUIRE(!solved.empty());
  const auto gone = std::find_if(solved.begin(), solved.end(), [&](auto k) { return k != m.tree().root(); });
  REQUIRE(gone != solved.end());
  const slam::keyframe_id erased = *gone;
  m.erase_keyframe(erased);
  const auto motion = slam::detail::propagate_motion(m, solved, poses);
  REQUIRE(motion.size() == m.keyframes().size());
  CHECK_FALSE(motion.contains(erased.value()));  // no keyframe any more
  for (const auto& k : m.keyframes()) {
    const auto at = std::find(solved.begin(), solved.end(), k.id);
    const auto parent = m.tree().parent(k.id);
    if (at != solved.end()) {
      const sim3& to = poses[static_cast<std::size_t>(at - solved.begin())];
      CHECK((motion.at(k.id.value()) * sim3(k.T_world_camera) * to.inverse()).log().norm() < 1e-9);
    } else {
      const sim3 expected = parent == slam::no_id ? sim3{} : motion.at(parent.value());
      CHECK((motion.at(k.id.value()) * expected.inverse()).log().norm() < 1e-12);
    }
  }
}

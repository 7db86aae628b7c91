// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/slam/detail/loops/global_adjustment.hpp>
#include <orbis/slam/detail/loops/loop_correction.hpp>

#include "slam/at_once.hpp"
#include "slam/random_map.hpp"
#include "slam/ring_world.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

namespace global = slam::detail::global_adjustment;

slam::detail::bundle_solution solve(const global::snapshot& taken, const slam::camera_rig<camera::any_camera>& rig,
                                    const progress& callback = {}) {
  return slam::detail::bundle_solver<camera::any_camera>{rig.model, global::loss}.solve(
      taken, global::make_schedule({}), callback);
}

/// A map whose loop was closed, and is still bent.
[[nodiscard]] slam::map closed_ring(test::ring_world& world) {
  slam::map m = world.round(4);
  const auto last = m.keyframes().back().id;
  const auto check = test::verify_loop(m, last, m, 3, world.rig);
  test::close_loop(m, check.match, world.rig);
  return m;
}

}  // namespace

TEST_CASE("Adjusting a whole map takes out what closing its loop has left, and finds what is wrong") {
  test::ring_world world({.steps = 60});
  slam::map m = closed_ring(world);
  // Two keypoints of keyframe 20 are said to show the landmarks of two others.
  std::vector<slam::landmark_id> swapped;
  std::vector<std::uint32_t> keypoints;
  for (std::uint32_t i = 0; i < m.at(20).size() && swapped.size() < 2; ++i)
    if (m.landmark_at(m.at(20).landmarks[i]).observations.size() > 6 &&
        (swapped.empty() || (m.at(20).pixel(i) - m.at(20).pixel(keypoints[0])).norm() > 200)) {
      swapped.push_back(m.at(20).landmarks[i]);
      keypoints.push_back(i);
    }
  REQUIRE(swapped.size() == 2);
  for (const auto l : swapped) m.erase_observation(l, 20);
  REQUIRE(m.add_observation(swapped[0], 20, keypoints[1]));
  REQUIRE(m.add_observation(swapped[1], 20, keypoints[0]));
  m.erase_keyframe(30);
  const slam::map before = m;

  const auto report = test::adjust_map(m, world.rig);
  CHECK(test::fault_of(m) == "");
  CHECK(report.keyframes == 63);
  CHECK(report.landmarks > 1000);
  CHECK(report.iterations > 2);
  CHECK(report.final_cost < 0.5 * report.initial_cost);
  const auto [worst_before, mean_before] = world.errors(before);
  const auto [worst, mean] = world.errors(m);
  CHECK(worst < 0.5 * worst_before);
  CHECK(mean < 0.5 * mean_before);
  CHECK(m.at(0).T_world_camera.to_matrix() == before.at(0).T_world_camera.to_matrix());

  double now = 0.0, then = 0.0;
  for (const auto& l : m.landmarks()) {
    const auto& o = l.observations.front();
    const vec3& truth = world.point(world.point_of(o.keyframe, o.feature));
    now += (l.position - truth).norm();
    then += (before.landmark_at(l.id).position - truth).norm();
  }
  CHECK(now < 0.5 * then);
  for (const auto l : swapped) CHECK((!m.has_landmark(l) || m.landmark_at(l).seen_by(20) == nullptr));
  CHECK(report.outliers >= 2);
  CHECK(report.outliers < report.observations / 10);
}

TEST_CASE("What is added while a map is adjusted goes along, and what is gone is left alone") {
  test::ring_world world({.steps = 60});
  slam::map m = closed_ring(world);
  slam::map alone = m;
  test::adjust_map(alone, world.rig);

  const auto taken = test::take_map(m, world.rig);
  REQUIRE_FALSE(taken.empty());
  slam::frame next = m.at(63);
  for (std::size_t i = 0; i < next.size(); i += 2) next.landmarks[i] = slam::no_id;
  const auto first_new = m.landmark_end();
  const auto added = slam::detail::insert_keyframe(m, next, {});
  const auto below = slam::detail::insert_keyframe(m, next, {});
  REQUIRE(m.landmark_end() > first_new);
  const auto removed = m.at(25).landmarks[0], fused = m.at(40).landmarks[0], into = m.at(40).landmarks[1];
  m.remove_landmark(removed);
  m.fuse(fused, into);
  m.erase_keyframe(50);
  const slam::map before = m;
  const auto solved = solve(taken, world.rig);
  REQUIRE(solved.complete);
  test::apply_adjustment(m, taken, solved);
  CHECK(test::fault_of(m) == "");
  for (slam::keyframe_id k = 0; k < 64; ++k)
    if (k != 50) CHECK(m.at(k).T_world_camera.to_matrix() == alone.at(k).T_world_camera.to_matrix());
  const auto parent = before.tree().parent(added);
  REQUIRE(parent < 64);
  for (const auto k : {added, below}) {
    const se3 rigid = before.at(parent).T_world_camera.inverse() * before.at(k).T_world_camera;
    CHECK((m.at(parent).T_world_camera * rigid * m.at(k).T_world_camera.inverse()).log().norm() < 1e-9);
  }
  std::size_t went_along = 0;
  for (auto l = first_new; l < before.landmark_end(); ++l) {
    const auto by = before.landmark_at(l).created;
    const vec3 seen = before.at(by).T_world_camera.inverse() * before.landmark_at(l).position;
    CHECK((m.at(by).T_world_camera * seen - m.landmark_at(l).position).norm() < 1e-9);
    went_along += (m.landmark_at(l).position - before.landmark_at(l).position).norm() > 1e-4;
  }
  CHECK(went_along > 10);
}

TEST_CASE("Without depth what hangs on keyframes follows the lengths around them when a whole map is adjusted") {
  for (const bool with_depth : {false, true}) {
    test::ring_world world({.steps = 60, .drift = 0.2, .shrinks = with_depth ? 0.0 : 0.001});
    slam::map m(8, 1.2);
    world.walk(m, 0, 12, world.truth(0));
    const slam::keyframe_id last = m.keyframes().back().id;
    const slam::map before = m;
    const auto taken = test::take_map(m, world.rig);
    // A solution that makes everything larger as seen from the first keyframe, but for some points.
    constexpr double larger = 1.25;
    const vec3 centre = taken.poses.front().translation();
    slam::detail::bundle_solution solved;
    for (const se3& p : taken.poses)
      solved.poses.emplace_back(p.rotation(), vec3(centre + larger * (p.translation() - centre)));
    for (std::size_t i = 0; i != taken.points.size(); ++i)
      solved.points.emplace_back(centre + (i % 5 == 0 ? 0.8 : larger) * (taken.points[i] - centre));
    solved.outliers.assign(taken.observations.size(), 0);
    solved.usable = true;
    test::apply_adjustment(m, taken, solved);
    CHECK(test::fault_of(m) == "");
    const double expected = with_depth ? 1.0 : larger;
    std::size_t alone = 0;
    for (const auto& l : before.landmarks()) {
      if (l.observations.size() != 1 || l.created != last) continue;
      ++alone;
      const vec3 seen = before.at(last).T_world_camera.inverse() * l.position;
      const vec3 now = m.at(last).T_world_camera.inverse() * m.landmark_at(l.id).position;
      CHECK((now - expected * seen).norm() < 1e-9);
    }
    CHECK(alone > 10);
    CHECK(m.at(last).scale == Approx(expected));
    CHECK((m.at(last).T_world_camera.translation() - solved.poses.back().translation()).norm() < 1e-12);
  }
}

TEST_CASE("Without depth an adjusted map keeps no landmark that nothing determines any more") {
  test::ring_world world({.steps = 60, .drift = 0.2, .shrinks = 0.001});
  slam::map m(8, 1.2);
  world.walk(m, 0, 12, world.truth(0));
  // One of two observations of a landmark is that of another one.
  std::vector<slam::landmark_id> wrong;
  for (const auto& l : m.landmarks()) {
    if (l.observations.size() != 2 || wrong.size() == 3) continue;
    const auto [k, feature] = l.observations.back();
    for (std::uint32_t i = 0; i != m.at(k).size(); ++i)
      if (m.at(k).landmarks[i] == slam::no_id || (m.at(k).pixel(i) - m.at(k).pixel(feature)).norm() < 100)
        continue;
      else if (m.landmark_at(m.at(k).landmarks[i]).observations.size() == 1) {
        m.remove_landmark(m.at(k).landmarks[i]);
        m.erase_observation(l.id, k);
        REQUIRE(m.add_observation(l.id, k, i));
        wrong.push_back(l.id);
        break;
      }
  }
  REQUIRE(wrong.size() == 3);
  const auto report = test::adjust_map(m, world.rig);
  CHECK(report.outliers >= 3);
  CHECK(test::fault_of(m) == "");
  for (const slam::landmark_id l : wrong) CHECK_FALSE(m.has_landmark(l));
}

TEST_CASE("Adjustment is the same every time, and may be stopped") {
  test::ring_world world({.steps = 60, .density = 12.0});
  slam::map m(8, 1.2);
  CHECK(test::take_map(m, world.rig).empty());
  world.walk(m, 0, 12, world.truth(0));
  const slam::map before = m;
  slam::map again = m;

  const auto taken = test::take_map(m, world.rig);
  REQUIRE_FALSE(taken.empty());
  std::size_t calls = 0;
  const auto third = [&](std::size_t done, std::size_t total) {
    CHECK(done < total);
    return ++calls < 3;
  };
  const auto stopped = solve(taken, world.rig, third);
  CHECK_FALSE(stopped.complete);
  CHECK_FALSE(stopped.usable);
  CHECK(calls == 3);
  CHECK(test::same(before, m));

  const auto solved = solve(taken, world.rig);
  REQUIRE(solved.complete);
  test::apply_adjustment(m, taken, solved);
  test::adjust_map(again, world.rig);
  CHECK(test::same(m, again));
  CHECK_FALSE(test::same(m, before));
  slam::map single(8, 1.2);
  world.walk(single, 0, 1, world.truth(0));
  CHECK(test::adjust_map(single, world.rig).keyframes == 0);
}

TEST_CASE("A map may be gathered part by part, what is added in between takes no part") {
  test::ring_world world({.steps = 60});
  const slam::map before = closed_ring(world);
  slam::map whole = before, parts = before;
  const auto at_once = test::take_map(whole, world.rig);
  REQUIRE_FALSE(at_once.empty());
  slam::frame next = before.at(63);
  for (std::size_t i = 0; i < next.size(); i += 2) next.landmarks[i] = slam::no_id;
  slam::detail::insert_keyframe(whole, next, {});

  std::size_t steps = 1;
  auto taken = global::take_keyframes(parts);
  REQUIRE(taken.has_more());
  for (;; ++steps) {
    global::take_landmarks(taken, parts, world.rig, 500);
    if (!taken.has_more()) break;
    if (steps == 1) slam::detail::insert_keyframe(parts, next, {});
  }
  CHECK(steps == (before.landmark_end().value() + 499) / 500);
  REQUIRE(steps > 2);
  REQUIRE_FALSE(taken.empty());
  const auto solved_at_once = solve(at_once, world.rig), solved = solve(taken, world.rig);
  REQUIRE((solved_at_once.complete && solved.complete));
  test::apply_adjustment(whole, at_once, solved_at_once);
  test::apply_adjustment(parts, taken, solved);
  CHECK(test::fault_of(parts) == "");
  REQUIRE(parts.keyframes().size() == whole.keyframes().size());
  for (const auto& k : whole.keyframes())
    CHECK(parts.at(k.id).T_world_camera.to_matrix() == k.T_world_camera.to_matrix());
  REQUIRE(parts.landmark_count() == whole.landmark_count());
  for (const auto& l : whole.landmarks()) CHECK(parts.landmark_at(l.id).position == l.position);
}

TEST_CASE("Outliers may be erased part by part") {
  test::ring_world world({.steps = 60});
  slam::map m = closed_ring(world);
  const global::snapshot taken = test::take_map(m, world.rig);
  slam::detail::bundle_solution solved = solve(taken, world.rig);
  REQUIRE(solved.usable);
  for (std::size_t i = 0; i < solved.outliers.size(); i += 7) solved.outliers[i] = 1;
  slam::map parts = m;
  const slam::map before = m;
  const auto report = test::apply_adjustment(m, taken, solved);
  CHECK(report.outliers > solved.outliers.size() / 10);
  global::apply_poses(parts, taken, solved);
  std::size_t erased = 0, steps = 0;
  for (std::size_t at = 0; at < taken.observations.size(); at += 1000, ++steps)
    erased += global::erase_outliers(parts, taken, solved, at, 1000);
  CHECK(steps > 3);
  CHECK(erased == report.outliers);
  slam::detail::update_landmarks(parts, 0, parts.landmark_count());
  CHECK(test::same(m, parts));
  CHECK_FALSE(test::same(m, before));
  CHECK(test::fault_of(parts) == "");
}

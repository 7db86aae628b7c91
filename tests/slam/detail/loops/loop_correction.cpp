// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/slam/detail/loops/global_adjustment.hpp>
#include <orbis/slam/detail/loops/loop_correction.hpp>

#include "slam/at_once.hpp"
#include "slam/random_map.hpp"
#include "slam/ring_world.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

/// A map with a loop to be closed, and the loop.
struct open_ring {
  test::ring_world world;
  slam::map m = world.round(4);
  slam::keyframe_id last = m.keyframes().back().id;
  slam::detail::loop_match match = test::verify_loop(m, last, m, 3, world.rig).match;
};

/// How far a keyframe is from where the truth puts it, as seen from keyframe 0.
[[nodiscard]] double error_of(const open_ring& r, const slam::map& m, slam::keyframe_id k) {
  return (m.pose(k).translation() - r.world.truth(k.value()).translation()).norm();
}

}  // namespace

TEST_CASE("Closing a loop takes the drift out of keyframes and landmarks, erased keyframes among them") {
  open_ring r;
  r.m.erase_keyframe(40);
  const slam::map before = r.m;
  REQUIRE(r.match.inliers >= 40);
  const auto report = test::close_loop(r.m, r.match, r.world.rig);
  CHECK(report.corrected);
  CHECK(report.keyframes == 103);
  CHECK(report.moved > 0.2);
  CHECK(report.turned > 0.05);
  CHECK(test::fault_of(r.m) == "");

  const auto [worst_before, mean_before] = r.world.errors(before);
  const auto [worst, mean] = r.world.errors(r.m);
  CHECK(worst_before > 0.2);
  CHECK(worst < 0.4 * worst_before);
  CHECK(mean < 0.6 * mean_before);
  CHECK(error_of(r, r.m, r.last) < 0.1 * error_of(r, before, r.last));
  CHECK(error_of(r, r.m, 40) < 1.1 * std::max(error_of(r, r.m, 39), error_of(r, r.m, 41)));
  CHECK((r.m.at(0).T_world_camera.to_matrix() - before.at(0).T_world_camera.to_matrix()).norm() == 0.0);  // the root

  // The relative pose of the two is what was measured.
  const se3 now = r.m.at(3).T_world_camera.inverse() * r.m.at(r.last).T_world_camera;
  CHECK((now.inverse() * r.match.T_candidate_keyframe).log().norm() < 0.01);

  // Both sides of the loop see the same landmarks now: the right ones.
  CHECK(report.fusion.fused > 120);
  CHECK(r.m.landmark_count() == before.landmark_count() - report.fusion.fused);
  CHECK(r.m.covisibility().shared(r.last, 3) > 60);
  CHECK(r.m.tree().loop_edges(r.last) == std::vector<slam::keyframe_id>{3});
  std::size_t wrong = 0, both = 0;
  for (const auto& l : r.m.landmarks()) {
    const auto point = r.world.point_of(l.observations.front().keyframe, l.observations.front().feature);
    for (const auto& o : l.observations) wrong += r.world.point_of(o.keyframe, o.feature) != point;
    both += l.observations.front().keyframe < 10 && l.observations.back().keyframe > 90;
  }
  CHECK(wrong == 0);
  CHECK(both > 120);

  // Landmarks went along.
  double worst_landmark = 0.0;
  for (const auto& l : r.m.landmarks()) {
    const auto& o = l.observations.front();
    worst_landmark =
        std::max(worst_landmark, (l.position - r.world.point(r.world.point_of(o.keyframe, o.feature))).norm());
  }
  CHECK(worst_landmark < worst + 0.2);

  // A second time there is nothing left to gain.
  const auto again = test::close_loop(r.m, r.match, r.world.rig);
  CHECK(again.corrected);
  CHECK(again.moved < 0.01);
  CHECK(again.fusion.fused < report.fusion.fused / 20);
  CHECK(test::fault_of(r.m) == "");
}

TEST_CASE("Where keyframes with a loop edge are erased, the next correction still has a tie between both sides") {
  open_ring r;
  REQUIRE(test::close_loop(r.m, r.match, r.world.rig).corrected);
  // All that saw the place from either side but the first few and the last few, which share nothing with each other.
  for (std::uint32_t k = 2; k <= 12; ++k) r.m.erase_keyframe(k);
  for (std::uint32_t k = 92; k <= r.last.value(); ++k) r.m.erase_keyframe(k);
  const slam::keyframe_id a = r.m.replacement(r.match.keyframe), b = r.m.replacement(r.match.candidate);
  REQUIRE(r.m.tree().loop_edges(a) == std::vector<slam::keyframe_id>{b});
  CHECK(r.m.covisibility().shared(a, b) < 25);

  slam::detail::loop_match elsewhere = r.match;
  elsewhere.keyframe = 60;
  elsewhere.candidate = 30;
  const auto taken = slam::detail::loop_correction::take(r.m, elsewhere);
  REQUIRE(taken);
  const auto tie = std::find_if(taken->edges.begin(), taken->edges.end(), [&](const auto& e) {
    return taken->keyframes[e.from] == std::max(a, b) && taken->keyframes[e.to] == std::min(a, b);
  });
  REQUIRE(tie != taken->edges.end());
  CHECK(tie->weight == 0.25);
  CHECK(test::fault_of(r.m) == "");
}

TEST_CASE("Without depth a loop takes out the drift of the scale as well") {
  test::ring_world world{{.shrinks = 0.004}};
  slam::map m = world.round(4);
  m.erase_keyframe(40);
  const slam::keyframe_id last = m.keyframes().back().id;
  const auto check = test::verify_loop(m, last, m, 3, world.rig, {.max_rotation = 1.0});
  CHECK(to_string(check.verdict) == "accepted");
  const double shrunk = std::pow(1.0 - 0.004, 100);
  CHECK(check.match.scale == Approx(1.0 / shrunk).epsilon(0.01));
  const slam::map before = m;
  const auto report = test::close_loop(m, check.match, world.rig);
  CHECK(report.corrected);
  CHECK(report.scale == Approx(1.0 / shrunk).epsilon(0.02));
  CHECK(test::fault_of(m) == "");
  const auto [worst_before, mean_before] = world.errors(before);
  const auto [worst, mean] = world.errors(m);
  CHECK(worst_before > 0.5);
  CHECK(worst < 0.3 * worst_before);
  CHECK(mean < 0.3 * mean_before);
  // An erased keyframe, and what was noted relative to one, follow.
  const auto error_of = [&](slam::keyframe_id k) {
    return (m.pose(k).translation() - world.truth(k.value()).translation()).norm();
  };
  CHECK(error_of(40) < 1.1 * std::max(error_of(39), error_of(41)));
  CHECK(m.scale(40) == Approx(m.scale(41)).epsilon(0.01));
  CHECK(m.scale(0) == 1.0);
  CHECK(m.scale(last) == Approx(report.scale));
  // Global adjustment takes the rest out, and does not lose the scale.
  test::adjust_map(m, world.rig);
  CHECK(test::fault_of(m) == "");
  CHECK(world.errors(m)[1] < 1.2 * mean);
}

TEST_CASE("What is added while a loop is solved goes along") {
  open_ring r;
  slam::map alone = r.m;
  test::close_loop(alone, r.match, r.world.rig);

  const auto taken = slam::detail::loop_correction::take(r.m, r.match);
  REQUIRE(taken);
  // Two keyframes follow, one of which is gone again, and new landmarks.
  const se3 step = r.world.truth(r.last.value()).inverse() * r.world.truth(r.last.value() + 1);
  slam::frame next = r.world.look(r.last.value() + 1, r.m.at(r.last).T_world_camera * step);
  for (std::uint32_t i = 0; i < next.size(); ++i)
    for (std::uint32_t j = 0; j < r.m.at(r.last).size(); ++j)
      if (r.world.point_of(r.last, j) == r.world.point_of(r.last + 1, i))
        next.landmarks[i] = r.m.at(r.last).landmarks[j];
  const auto first_new = r.m.landmark_end();
  const auto added = slam::detail::insert_keyframe(r.m, next, {});
  const auto below = slam::detail::insert_keyframe(r.m, next, {});
  const auto gone = slam::detail::insert_keyframe(r.m, next, {});
  r.m.erase_keyframe(gone);
  r.m.remove_landmark(r.m.at(20).landmarks[0]);
  REQUIRE(r.m.landmark_end() > first_new);
  const slam::map before = r.m;
  const auto solved = slam::detail::loop_correction::solve(*taken, r.world.rig);
  REQUIRE(solved);
  const auto report = test::apply_correction(r.m, *taken, *solved);
  CHECK(report.corrected);
  CHECK(test::fault_of(r.m) == "");
  const auto parent = before.tree().parent(added);
  for (const auto k : {added, below}) {
    const se3 rigid = before.at(parent).T_world_camera.inverse() * before.at(k).T_world_camera;
    CHECK((r.m.at(parent).T_world_camera * rigid * r.m.at(k).T_world_camera.inverse()).log().norm() < 1e-9);
  }
  for (auto l = first_new; l < before.landmark_end(); ++l) {
    if (!r.m.has_landmark(l)) continue;
    const auto by = before.landmark_at(l).observations.front().keyframe;
    const vec3 seen = before.at(by).T_world_camera.inverse() * before.landmark_at(l).position;
    CHECK((r.m.at(by).T_world_camera * seen - r.m.landmark_at(l).position).norm() < 1e-9);
  }
  for (slam::keyframe_id k = 0; k <= r.last; ++k)  // the others are where they are without these
    CHECK((r.m.at(k).T_world_camera.to_matrix() - alone.at(k).T_world_camera.to_matrix()).norm() < 1e-12);
  CHECK(error_of(r, r.m, added) < 0.2 * error_of(r, before, added));
}

TEST_CASE("A loop is closed alike every time, one that is stopped, or has lost a keyframe, changes nothing") {
  open_ring r;
  slam::map again = r.m;
  const slam::map before = r.m;

  const auto taken = slam::detail::loop_correction::take(r.m, r.match);
  REQUIRE(taken);
  const auto never = [](std::size_t, std::size_t) { return false; };
  CHECK_FALSE(slam::detail::loop_correction::solve(*taken, r.world.rig, {}, never));
  CHECK(test::same(before, r.m));
  const auto solved = slam::detail::loop_correction::solve(*taken, r.world.rig);
  REQUIRE(solved);
  test::apply_correction(r.m, *taken, *solved);
  CHECK_FALSE(test::same(before, r.m));
  test::close_loop(again, r.match, r.world.rig);
  CHECK(test::same(again, r.m));

  slam::map without = before;
  without.erase_keyframe(3);
  const slam::map kept = without;
  CHECK_FALSE(test::close_loop(without, r.match, r.world.rig).corrected);
  CHECK(test::same(kept, without));
}

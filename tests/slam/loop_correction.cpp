// SPDX-License-Identifier: BSD-3-Clause
//
// The pieces of a loop's correction put together: the essential graph, optimised as a pose graph, moves keyframes and
// landmarks.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/random.hpp>
#include <orbis/optimize/pose_graph.hpp>
#include <orbis/slam/correction.hpp>
#include <orbis/slam/essential_graph.hpp>

#include "slam/random_map.hpp"
#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("Closing a loop takes the drift out of keyframes and landmarks, erased keyframes among them") {
  random_bits random(1);
  constexpr slam::keyframe_id steps = 30;
  // Once around a circle of two metres, each step a little too long and turned too far.
  const auto truth = [](slam::keyframe_id i) {
    const double angle = 2.0 * std::numbers::pi * i / steps;
    return se3(so3::exp(vec3(0, -angle, 0)), vec3(2 * std::cos(angle), 0, 2 * std::sin(angle)));
  };
  const se3 drift(so3::exp(vec3(0.001, 0.004, -0.002)), vec3(0.004, -0.003, 0.005));
  slam::map m(8, 1.2);
  se3 estimate = truth(0);
  for (slam::keyframe_id i = 0; i < steps; ++i) {
    if (i > 0) estimate = estimate * (truth(i - 1).inverse() * truth(i)) * drift;
    auto f = test::random_frame(random, 60, i);
    f.T_world_camera = estimate;
    if (i > 0) std::copy_n(m.at(i - 1).landmarks.begin() + 20, 40, f.landmarks.begin());
    slam::insert_keyframe(m, std::move(f), {});
  }
  m.erase_keyframe(12);
  m.add_loop_edge(0, steps - 1);
  const slam::map before = m;

  auto edges = slam::essential_graph(m, 20);
  CHECK(edges.size() == 28 + 1 + 25);  // the tree, the loop, the pairs two steps apart but for 12 and its heir
  for (auto& e : edges)
    if (e.kind == slam::edge_kind::loop) e.measurement = truth(e.from).inverse() * truth(e.to);
  std::vector<se3> poses = slam::poses_of(m);
  std::vector<std::uint8_t> fixed(poses.size(), 0);
  fixed[m.tree().root()] = 1;
  optimize::pose_graph_solver<se3> solver;
  const auto summary = solver.solve(seq, std::span<se3>(poses), edges, {.max_iterations = 20, .fixed = fixed});
  REQUIRE_FALSE(optimize::is_failure(summary.status));
  CHECK(poses[12].log().norm() == 0.0);  // no edge touches it

  std::vector<slam::keyframe_id> moved;
  std::vector<se3> to;
  for (const auto& k : m.keyframes()) {
    moved.push_back(k.id);
    to.push_back(poses[k.id]);
  }
  slam::move_keyframes(m, moved, to);
  CHECK(test::fault_of(m) == "");

  double worst_before = 0.0, worst = 0.0;
  for (slam::keyframe_id i = 0; i < steps; ++i) {
    const vec3 true_place = truth(i).translation();
    worst_before = std::max(worst_before, (before.pose_of(i).translation() - true_place).norm());
    worst = std::max(worst, (m.pose_of(i).translation() - true_place).norm());
  }
  CHECK(worst_before > 0.15);
  CHECK(worst < 0.6 * worst_before);
  CHECK((m.pose_of(steps - 1).translation() - truth(steps - 1).translation()).norm() < 0.1 * worst_before);
  for (const auto& l : m.landmarks()) {  // each where its oldest keyframe sees it
    const auto k = l.observations.front().keyframe;
    const vec3 seen = m.at(k).T_world_camera.inverse() * l.position;
    CHECK((seen - before.at(k).T_world_camera.inverse() * before.landmark_at(l.id).position).norm() < 1e-9);
  }
}

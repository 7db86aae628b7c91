// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/optimize/detail/pose/pose_graph_structure.hpp>
#include <orbis/optimize/pose_graph_problem.hpp>
#include <orbis/slam/detail/loops/loop_correction.hpp>

#include "slam/random_map.hpp"
#include "support/catch.hpp"

using namespace orbis;
using slam::detail::edge_kind;

TEST_CASE("The essential graph has the tree, the loops, and the strong pairs, each once") {
  for (std::uint64_t seed = 80; seed < 90; ++seed) {
    const slam::map m = test::random_map(seed, 1500);
    const auto edges = slam::detail::essential_graph(m, 4);
    std::set<std::pair<slam::keyframe_id, slam::keyframe_id>> pairs, tree, loops, strong;
    for (const auto& e : edges) {
      REQUIRE(pairs.insert(std::minmax(e.from, e.to)).second);
      (e.kind == edge_kind::tree ? tree : e.kind == edge_kind::loop ? loops : strong).insert(std::minmax(e.from, e.to));
      CHECK(e.shared == m.covisibility().shared(e.from, e.to));
      const sim3 expected(m.at(e.from).T_world_camera.inverse() * m.at(e.to).T_world_camera);
      CHECK((expected.inverse() * e.measurement).log().norm() < 1e-12);
    }
    CHECK(std::is_sorted(edges.begin(), edges.end(), [](const auto& a, const auto& b) { return a.from < b.from; }));
    CHECK(tree.size() + 1 == m.keyframes().size());
    for (const auto& a : m.keyframes())
      for (const auto& b : m.keyframes()) {
        if (a.id >= b.id) continue;
        const bool in_tree = m.tree().parent(a.id) == b.id || m.tree().parent(b.id) == a.id;
        const auto& of_a = m.tree().loop_edges(a.id);
        const bool in_loop = std::find(of_a.begin(), of_a.end(), b.id) != of_a.end();
        REQUIRE(tree.contains({a.id, b.id}) == in_tree);
        REQUIRE(loops.contains({a.id, b.id}) == (in_loop && !in_tree));
        REQUIRE(strong.contains({a.id, b.id}) == (m.covisibility().shared(a.id, b.id) >= 4 && !in_tree && !in_loop));
      }
  }
}

TEST_CASE("Poses on a loop: without a known scale its drift is spread over the keyframes with the rest") {
  // A walk round a square, one step a corner, each step's lengths 3 % less than they were before.
  constexpr int steps = 24;
  const sim3 right(so3::exp(vec3(0, 0, std::numbers::pi / 12)), vec3(1, 0, 0), 1.0);
  const sim3 measured(right.rotation(), right.translation(), 0.97);
  std::vector<sim3> truth(1), poses(1);
  for (int i = 1; i != steps; ++i) {
    truth.push_back(truth.back() * right);
    const sim3 next = poses.back() * measured;
    poses.push_back(next);
  }
  std::vector<slam::detail::essential_edge> edges;
  for (std::uint32_t i = 1; i != steps; ++i) {
    // What a map knows: poses without scale, whose lengths have shrunk so far.
    poses[i] = sim3(poses[i].rotation(), poses[i].translation(), 1.0);
    edges.push_back({i, i - 1, edge_kind::tree, 100, poses[i].inverse() * poses[i - 1]});
  }
  const double shrunk = std::pow(0.97, steps - 1);
  const sim3 closes = truth.front().inverse() * truth.back();
  edges.push_back(
      {0, steps - 1, edge_kind::loop, 100, sim3(closes.rotation(), closes.translation(), 1.0 / shrunk), 100.0});
  std::vector<std::uint8_t> fixed(steps, 0);
  fixed[0] = 1;
  const auto error_of = [&](const std::vector<sim3>& p) {
    double worst = 0.0;
    for (int i = 0; i != steps; ++i) worst = std::max(worst, (p[i].translation() - truth[i].translation()).norm());
    return worst;
  };
  std::vector<sim3> rigid = poses, similar = poses;
  REQUIRE(slam::detail::optimize_poses(rigid, edges, fixed, true, 50));
  REQUIRE(slam::detail::optimize_poses(similar, edges, fixed, false, 50));
  for (const sim3& p : rigid) CHECK(p.scale() == 1.0);
  CHECK(similar.front().scale() == 1.0);
  CHECK(similar.back().scale() == Approx(1.0 / shrunk).epsilon(0.02));
  CHECK(error_of(poses) > 1.0);
  CHECK(error_of(similar) < 0.2 * error_of(poses));
  CHECK(error_of(similar) < 0.5 * error_of(rigid));
}

TEST_CASE("Only the tree is left when nothing is strong, and nothing when there is no keyframe") {
  const slam::map m = test::random_map(91, 200);
  for (const auto& e : slam::detail::essential_graph(m, 1000)) CHECK(e.kind != edge_kind::covisibility);
  CHECK(slam::detail::essential_graph(slam::map(8, 1.2)).empty());
}

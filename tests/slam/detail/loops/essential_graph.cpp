// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/optimize/detail/pose/pose_graph_structure.hpp>
#include <orbis/optimize/pose_graph_problem.hpp>
#include <orbis/slam/detail/loops/essential_graph.hpp>

#include "slam/random_map.hpp"
#include "support/catch.hpp"

using namespace orbis;
using slam::detail::edge_kind;

static_assert(optimize::relative_measurement<slam::detail::essential_edge, se3>);

TEST_CASE("The essential graph has the tree, the loops, and the strong pairs, each once") {
  for (std::uint64_t seed = 80; seed < 90; ++seed) {
    const slam::map m = test::random_map(seed, 1500);
    const auto edges = slam::detail::essential_graph(m, 4);
    std::set<std::pair<slam::keyframe_id, slam::keyframe_id>> pairs, tree, loops, strong;
    for (const auto& e : edges) {
      REQUIRE(pairs.insert(std::minmax(e.from, e.to)).second);
      (e.kind == edge_kind::tree ? tree : e.kind == edge_kind::loop ? loops : strong).insert(std::minmax(e.from, e.to));
      CHECK(e.shared == m.covisibility().shared(e.from, e.to));
      const se3 expected = m.at(e.from).T_world_camera.inverse() * m.at(e.to).T_world_camera;
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

TEST_CASE("Only the tree is left when nothing is strong, and nothing when there is no keyframe") {
  const slam::map m = test::random_map(91, 200);
  for (const auto& e : slam::detail::essential_graph(m, 1000)) CHECK(e.kind != edge_kind::covisibility);
  CHECK(slam::detail::essential_graph(slam::map(8, 1.2)).empty());
  CHECK(slam::detail::poses_of(slam::map(8, 1.2)).empty());
}

// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <orbis/optimize/detail/pose/pose_graph_structure.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::optimize;
using optimize::detail::pose_graph_structure;

namespace {

using edge = pose_graph_edge<se3>;

std::vector<edge> edges_between(const std::vector<std::pair<std::uint32_t, std::uint32_t>>& ends) {
  std::vector<edge> edges;
  for (const auto& [from, to] : ends) edges.push_back({.from = from, .to = to});
  return edges;
}

}  // namespace

TEST_CASE("What moves in a pose graph: all but fixed vertices, those without edges, and what holds a piece") {
  pose_graph_structure s;
  bool changed = false;
  const auto chain = edges_between({{0, 1}, {1, 2}, {4, 2}});
  // One piece: its first vertex holds it; vertex 3 has no edges.
  CHECK_FALSE(is_failure(s.update(5, chain, {}, pose_graph_gauge::automatic, changed).status));
  CHECK(changed);
  CHECK(s.vertices == std::vector<std::uint32_t>{1, 2, 4});
  CHECK(s.unknown[0] == pose_graph_structure::held);
  CHECK(s.unknown[3] == pose_graph_structure::held);
  // The same again is no change; another fixed vertex is.
  CHECK_FALSE(is_failure(s.update(5, chain, {}, pose_graph_gauge::automatic, changed).status));
  CHECK_FALSE(changed);
  const std::vector<std::uint8_t> fixed{0, 0, 1, 0, 0};
  CHECK_FALSE(is_failure(s.update(5, chain, fixed, pose_graph_gauge::automatic, changed).status));
  CHECK(changed);
  CHECK(s.vertices == std::vector<std::uint32_t>{0, 1, 4});

  // Two pieces: refused, or held by their first.
  const auto pieces = edges_between({{0, 1}, {3, 4}});
  const auto refused = s.update(5, pieces, {}, pose_graph_gauge::automatic, changed);
  CHECK(refused.status == pose_graph_status::no_gauge);
  CHECK(refused.where == 0);
  CHECK_FALSE(is_failure(s.update(5, pieces, {}, pose_graph_gauge::first_of_each_piece, changed).status));
  CHECK(s.vertices == std::vector<std::uint32_t>{1, 4});
  CHECK(s.update(5, chain, {}, pose_graph_gauge::as_given, changed).status == pose_graph_status::no_gauge);
}

TEST_CASE("Edges between the same vertices share a bundle, and every vertex knows its bundles") {
  pose_graph_structure s;
  bool changed = false;
  const auto edges = edges_between({{0, 1}, {2, 1}, {1, 2}, {2, 3}, {1, 0}, {1, 2}});
  REQUIRE_FALSE(is_failure(s.update(4, edges, {}, pose_graph_gauge::automatic, changed).status));
  REQUIRE(s.bundles.size() == 3);
  REQUIRE(s.places.size() == 2);  // those between two that move come first
  std::vector<int> counts;
  for (const auto& b : s.bundles) {
    counts.push_back(static_cast<int>(b.count));
    for (std::uint32_t at = b.begin; at != b.begin + b.count; ++at) {
      const edge& e = edges[s.bundled[at]];
      CHECK(((e.from == b.from && e.to == b.to) || (e.from == b.to && e.to == b.from)));
    }
  }
  CHECK(counts == std::vector<int>{3, 1, 2});
  for (std::uint32_t u = 0; u != s.vertices.size(); ++u)
    for (std::uint32_t at = s.first_touch[u]; at != s.first_touch[u + 1]; ++at) {
      const auto& b = s.bundles[s.touches[at] / 2];
      CHECK((s.touches[at] % 2 != 0 ? b.to : b.from) == s.vertices[u]);
    }
  CHECK(s.touches.size() == 5);  // one end of the first bundle is held
}

TEST_CASE("A pose graph is checked before it is solved") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<se3> vertices(3);
  auto edges = edges_between({{0, 1}, {1, 2}});
  const auto check = [&](bool semidefinite = false) {
    const auto found = optimize::detail::check_pose_graph<6>(std::span<const se3>(vertices), edges, semidefinite);
    CHECK(found.where == (is_failure(found.status) ? 1U : 0U));
    return found.status;
  };
  CHECK_FALSE(is_failure(check()));
  vertices[1] = se3(so3{}, vec3(0, nan, 0));
  CHECK(check() == pose_graph_status::bad_vertex);
  vertices[1] = se3{};
  edges[1].to = 9;
  CHECK(check() == pose_graph_status::missing_vertex);
  edges[1].to = 1;
  CHECK(check() == pose_graph_status::self_edge);
  edges[1].to = 2;
  edges[1].measurement = se3(so3{}, vec3(nan, 0, 0));
  CHECK(check() == pose_graph_status::bad_measurement);
  edges[1].measurement = se3{};
  edges[1].information(0, 1) = 0.5;  // not symmetric
  CHECK(check() == pose_graph_status::bad_information);
  edges[1].information = mat6::Identity();
  edges[1].information(2, 2) = 0.0;
  CHECK(check() == pose_graph_status::bad_information);
  CHECK_FALSE(is_failure(check(true)));
  // Units do not matter.
  edges[1].information = (vec6() << 1e12, 1e12, 1e12, 1e-6, 1e-6, 1e-6).finished().asDiagonal();
  CHECK_FALSE(is_failure(check()));
}

// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/core/sim3.hpp>
#include <orbis/optimize/pose_graph-inl.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::optimize;

TEST_CASE("Sim(3) graphs distribute the drift of scale round a loop") {
  // A circle whose odometry shrinks by 1 % a step; one closure knows better.
  const std::uint32_t n = 60;
  std::vector<sim3> truth, vertices;
  std::vector<pose_graph_edge<sim3>> edges;
  for (std::uint32_t i = 0; i != n; ++i) {
    const so3 r = so3::exp(vec3(0, 0, 2.0 * std::acos(-1.0) * i / n));
    truth.emplace_back(r, r * vec3(5, 0, 0), 1.0);
  }
  const sim3 drift{so3{}, vec3::Zero(), 0.99};
  for (std::uint32_t i = 0; i != n; ++i) {
    const std::uint32_t next = (i + 1) % n;
    const sim3 between = truth[i].inverse() * truth[next];
    edges.push_back({.from = i, .to = next, .measurement = next == 0 ? between : between * drift});
    if (next == 0) edges.back().information *= 1e6;
  }
  vertices.push_back(truth[0]);
  for (std::uint32_t i = 0; i + 1 != n; ++i) vertices.push_back(vertices.back() * edges[i].measurement);
  CHECK(vertices.back().scale() < 0.6);
  pose_graph_solver<sim3> solver;
  const auto s = solver.solve(seq, std::span<sim3>{vertices}, edges, {.relative_tolerance = 1e-10});
  CHECK(s.status == pose_graph_status::converged);
  CHECK(vertices.back().scale() == Approx(1.0).epsilon(1e-3));
  // Each edge takes its share of the drift, so that no scale but the smallest in the middle is left.
  for (const sim3& v : vertices) CHECK(std::abs(std::log(v.scale())) < 0.02);
}

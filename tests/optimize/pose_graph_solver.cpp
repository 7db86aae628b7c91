// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/optimize/pose_graph.hpp>

#include "pose_graphs.hpp"
#include "support/allocations.hpp"
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
  const auto s = solve_pose_graph(seq, vertices, edges, {.relative_tolerance = 1e-10});
  CHECK(s.status == pose_graph_status::converged);
  CHECK(vertices.back().scale() == Approx(1.0).epsilon(1e-3));
  // Each edge takes its share of the drift, so that no scale but the smallest in the middle is left.
  for (const sim3& v : vertices) CHECK(std::abs(std::log(v.scale())) < 0.02);
}

TEST_CASE("A solver that is used again allocates nothing and gives the same bits") {
  const auto made = test::small_graphs()[0];
  const auto check = [&](auto damping) {
    pose_graph_solver<se3, huber, decltype(damping)> solver{huber{3.0}, damping};
    std::vector<se3> first = made.measured.vertices, second = first;
    const pose_graph_options options{.fixed = made.measured.fixed};
    const auto s = solver.solve(seq, std::span<se3>{first}, made.measured.edges, options);
    const std::size_t before = test::allocations();
    const auto t = solver.solve(seq, std::span<se3>{second}, made.measured.edges, options);
    const std::size_t after = test::allocations();
    if (test::counts_allocations()) CHECK(after == before);
    CHECK(s.status == pose_graph_status::converged);
    CHECK(t.final_cost == s.final_cost);
    CHECK(test::same_bits(first, second));
  };
  check(gauss_newton{});
  check(levenberg_marquardt{});
  check(dogleg{});
  // Another graph in the same solver is another problem.
  pose_graph_solver<se3> solver;
  for (const auto& graph : test::small_graphs()) {
    std::vector<se3> kept = graph.measured.vertices, fresh = kept;
    solver.solve(seq, std::span<se3>{kept}, graph.measured.edges);
    solve_pose_graph(seq, fresh, graph.measured.edges);
    CHECK(test::same_bits(kept, fresh));
  }
}

TEST_CASE("The report says what every step has reached") {
  const auto made = test::small_graphs()[1];
  std::vector<se3> vertices = made.measured.vertices;
  pose_graph_solver<se3> solver;
  std::vector<double> costs;
  const auto s =
      solver.solve(seq, std::span<se3>{vertices}, made.measured.edges, {}, {}, [&](const pose_graph_summary& now) {
        CHECK(now.iterations == static_cast<int>(costs.size()));
        costs.push_back(now.final_cost);
      });
  REQUIRE(costs.size() == static_cast<std::size_t>(s.iterations) + 1);
  CHECK(costs.front() == s.initial_cost);
  CHECK(costs.back() == s.final_cost);
  CHECK(std::is_sorted(costs.rbegin(), costs.rend()));
  const pose_graph_times& t = s.seconds;
  for (const double seconds : {t.set_up, t.linearize, t.factor, t.solve, t.evaluate}) CHECK(seconds > 0.0);
}

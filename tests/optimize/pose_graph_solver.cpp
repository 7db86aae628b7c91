// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include <orbis/optimize/pose_graph-inl.hpp>

#include "pose_graphs.hpp"
#include "support/allocations.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::optimize;

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
    test::solve_pose_graph(seq, fresh, graph.measured.edges);
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

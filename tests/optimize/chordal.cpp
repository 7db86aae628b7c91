// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph/chordal.hpp"

#include <cmath>
#include <cstring>
#include <limits>

#include <orbis/optimize/pose_graph-inl.hpp>

#include "pose_graphs.hpp"
#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::optimize;
using examples::start_chordally;

TEST_CASE("Without noise the truth comes out, wherever the vertices were") {
  random_bits random{371};
  for (const test::synthetic_graph& made : test::small_graphs(1e-9)) {
    std::vector<se3> vertices;
    for (std::size_t i = 0; i != made.truth.size(); ++i) vertices.push_back(test::random_pose(random, 50.0));
    vertices[0] = made.truth[0];
    REQUIRE(start_chordally(std::span<se3>{vertices}, made.measured.edges, {.fixed = made.measured.fixed}).status ==
            pose_graph_status::converged);
    CHECK(test::position_error(vertices, made.truth) < 1e-6);
    for (std::size_t i = 0; i != vertices.size(); ++i) CHECK(test::angle_between(vertices[i], made.truth[i]) < 1e-7);
    CHECK(test::same_bits({vertices[0]}, {made.truth[0]}));
  }
}

TEST_CASE("Noisy graphs converge from it to the best minimum, and from odometry do not") {
  // Odometry that is lost after a few turns.
  const auto run = [](const test::synthetic_graph& made, bool chordal) {
    std::vector<se3> vertices = made.measured.vertices;
    if (chordal)
      REQUIRE(start_chordally(std::span<se3>{vertices}, made.measured.edges, {.fixed = made.measured.fixed}).status ==
              pose_graph_status::converged);
    return test::solve<gauss_newton>(seq, vertices, made.measured.edges,
                                     {.max_iterations = 25, .fixed = made.measured.fixed});
  };
  const auto from_truth = [](const test::synthetic_graph& made) {
    std::vector<se3> vertices = made.truth;
    return test::solve<gauss_newton>(seq, vertices, made.measured.edges, {.fixed = made.measured.fixed});
  };
  int lost = 0;
  for (const test::graph_shape shape : {test::graph_shape::torus, test::graph_shape::sphere})
    for (const std::uint64_t seed : {1U, 2U}) {
      const auto made = test::make_pose_graph({.shape = shape,
                                               .poses_per_turn = 20,
                                               .turns = 25,
                                               .radius = 10.0,
                                               .translation_sigma = 0.1,
                                               .rotation_sigma = 0.3,
                                               .seed = seed});
      const double best = from_truth(made).final_cost;
      const auto started = run(made, true);
      CHECK(started.status == pose_graph_status::converged);
      CHECK(started.final_cost == Approx(best).epsilon(1e-4));
      CHECK(started.iterations <= 15);
      lost += run(made, false).final_cost > 1.02 * best ? 1 : 0;
    }
  CHECK(lost >= 3);
}

TEST_CASE("Fixed vertices hold the start, weights count, failures change nothing") {
  using edge = pose_graph_edge<se3>;
  const vec6 weak = vec6::Constant(1.0), strong = vec6::Constant(3.0);
  // Between two fixed ends, the middle is where the weights say.
  std::vector<edge> edges{
      {.from = 0, .to = 1, .measurement = se3{so3{}, vec3(1, 0, 0)}, .information = weak.asDiagonal()},
      {.from = 2, .to = 1, .measurement = se3{so3{}, vec3(-3, 0, 0)}, .information = strong.asDiagonal()}};
  const std::vector<std::uint8_t> ends{1, 0, 1};
  std::vector<se3> vertices{se3{}, se3{so3::exp(vec3(1, 2, 3)), vec3(9, 9, 9)}, se3{so3{}, vec3(6, 0, 0)}};
  REQUIRE(start_chordally(std::span<se3>{vertices}, edges, {.fixed = ends}).status == pose_graph_status::converged);
  CHECK((vertices[1].translation() - vec3(2.5, 0, 0)).norm() < 1e-12);
  CHECK(vertices[1].rotation().angle() < 1e-12);

  const auto before = vertices;
  const auto refused = [&](const std::vector<edge>& bad, pose_graph_status status, std::size_t where) {
    const auto s = start_chordally(std::span<se3>{vertices}, bad);
    CHECK(s.status == status);
    CHECK(s.where == where);
    CHECK(test::same_bits(vertices, before));
  };
  auto bad = edges;
  bad[1].to = 3;
  refused(bad, pose_graph_status::missing_vertex, 1);
  bad = edges;
  bad[0].measurement = se3{so3{}, vec3(std::numeric_limits<double>::quiet_NaN(), 0, 0)};
  refused(bad, pose_graph_status::bad_measurement, 0);
  CHECK(start_chordally(std::span<se3>{vertices}, std::vector<edge>{}).status == pose_graph_status::nothing_to_do);
  // Half a turn one way and half a turn the other, about axes at right angles: no rotation is nearest.
  bad = edges;
  const double pi = std::acos(-1.0);
  bad[0].measurement = se3{so3::exp(vec3(0, 0, pi)), vec3::Zero()};
  bad[1] = bad[0];
  bad[1].measurement = se3{so3{}, vec3::Zero()};
  std::vector<se3> two(2);
  CHECK(start_chordally(std::span<se3>{two}, bad).status == pose_graph_status::singular);
}

// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <numeric>

#include "support/catch.hpp"
#include "support/synthetic/pose_graph.hpp"

using namespace orbis;
using namespace orbis::io;
using namespace orbis::test;

namespace {

/// By how many sigmas an edge is off, in the mean of its six numbers.
double sigmas(const synthetic_graph& made, std::size_t k) {
  const g2o_edge& e = made.measured.edges[k];
  const se3 d = e.measurement.inverse() * (made.truth[e.from].inverse() * made.truth[e.to]);
  vec6 r;
  r << d.translation(), d.rotation().unit_quaternion().vec();
  return std::sqrt(r.dot(e.information * r) / 6.0);
}

}  // namespace

TEST_CASE("Generated graphs have the edges and the noise that was asked for") {
  for (const graph_shape shape : {graph_shape::sphere, graph_shape::torus, graph_shape::grid}) {
    const synthetic_graph_options options{.shape = shape, .poses_per_turn = 8, .turns = 12, .rotation_sigma = 0.01};
    const synthetic_graph made = make_pose_graph(options);
    const g2o_graph& g = made.measured;
    REQUIRE(g.vertices.size() == (shape == graph_shape::grid ? 512U : 96U));
    REQUIRE(made.truth.size() == g.vertices.size());
    REQUIRE(made.wrong.size() == g.edges.size());
    CHECK(g.edges.size() == (shape == graph_shape::grid ? 3U * 7U * 64U : 95U + 88U));
    CHECK(std::accumulate(g.fixed.begin(), g.fixed.end(), 0) == 1);
    double sum = 0.0;
    for (std::size_t k = 0; k != g.edges.size(); ++k) sum += sigmas(made, k) * sigmas(made, k);
    CHECK(sum / static_cast<double>(g.edges.size()) == Approx(1.0).epsilon(0.1));
    // Odometry begins with the truth and leaves it; neighbours are near each other in truth.
    CHECK((g.vertices[0].translation() - made.truth[0].translation()).norm() == 0.0);
    CHECK((g.vertices.back().translation() - made.truth.back().translation()).norm() > 0.1);
    for (const g2o_edge& e : g.edges)
      CHECK((made.truth[e.from].translation() - made.truth[e.to].translation()).norm() <
            (shape == graph_shape::grid ? 1.001 : 60.0));

    const synthetic_graph again = make_pose_graph(options);
    CHECK(again.measured.edges.back().measurement.translation() == g.edges.back().measurement.translation());
  }
}

TEST_CASE("Closures can be few, or wrong") {
  synthetic_graph_options options{.shape = graph_shape::torus, .poses_per_turn = 20, .turns = 30};
  options.closure_probability = 0.0;
  CHECK(make_pose_graph(options).measured.edges.size() == 599);
  options.closure_probability = 0.5;
  options.outlier_share = 0.2;
  const synthetic_graph made = make_pose_graph(options);
  CHECK(made.measured.edges.size() > 599 + 200);
  CHECK(made.measured.edges.size() < 599 + 380);
  int wrong = 0;
  for (std::size_t k = 0; k != made.wrong.size(); ++k) {
    wrong += made.wrong[k];
    CHECK((sigmas(made, k) > 5.0) == (made.wrong[k] != 0));
  }
  CHECK(wrong > 30);
  CHECK(wrong < 90);
}

// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>

#include <orbis/io/g2o.hpp>
#include <orbis/io/g2o_graph.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("a measurement is the pose of the second vertex in the frame of the first") {
  // Along x, a quarter turn to the left, and along the new x axis.
  const auto graph = io::parse_g2o(
      "VERTEX_SE3:QUAT 5 1 0 0 0 0 0.70710678118654752 0.70710678118654752\n"
      "VERTEX_SE3:QUAT 3 1 2 0 0 0 0.70710678118654752 0.70710678118654752\n"
      "EDGE_SE3:QUAT 5 3 2 0 0 0 0 0 1 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n");
  REQUIRE(graph.has_value());
  REQUIRE(graph->edges.size() == 1);
  const io::g2o_edge& e = graph->edges[0];
  CHECK((e.from == 0 && e.to == 1));
  const se3 expected = graph->vertices[e.from].inverse() * graph->vertices[e.to];
  CHECK((expected.translation() - e.measurement.translation()).norm() < 1e-12);
  CHECK((expected.rotation().inverse() * e.measurement.rotation()).log().norm() < 1e-12);
}

TEST_CASE("an edge that is made in memory weighs all directions alike") {
  const io::g2o_edge e;
  CHECK(e.information == mat6::Identity());
  const io::g2o_graph none;
  CHECK((none.vertices.empty() && none.edges.empty() && none.fixed.empty() && none.ids.empty()));
}

// SPDX-License-Identifier: BSD-3-Clause
#include <fstream>
#include <limits>
#include <string>

#include <orbis/io/g2o.hpp>

#include "support/catch.hpp"
#include "support/data.hpp"
#include "support/synthetic/pose_graph.hpp"
#include "support/temporary_folder.hpp"

using namespace orbis;
using io::parse_g2o;

namespace {

const std::string information = " 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21";
const std::string small =
    "# a comment\n"
    "VERTEX_SE3:QUAT 10 1 2 3 0 0 0 1\n"
    "EDGE_SE3:QUAT 10 -7 0.5 0 0 0 0 2 0" +
    information +
    " \r\n"
    "\n"
    "VERTEX_SE3:QUAT -7 4 5 6 0 0 0.6 0.8\n"
    "PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\n"
    "FIX 10\n";

/// Parsing fails with this kind of error, and a message that names line and reason.
void refused(const std::string& text, errc code, const std::string& where, const std::string& what) {
  const auto graph = parse_g2o(text, "some.g2o");
  REQUIRE_FALSE(graph.has_value());
  CHECK(graph.error().code == code);
  CHECK(graph.error().where == "some.g2o:" + where);
  INFO(graph.error().message);
  CHECK(graph.error().message.find(what) != std::string::npos);
  CHECK(graph.error().message.find('\n') == std::string::npos);
}

}  // namespace

TEST_CASE("A g2o graph is read, in any order of its lines") {
  const auto graph = parse_g2o(small);
  REQUIRE(graph.has_value());
  CHECK(graph->ids == std::vector<std::int64_t>{10, -7});
  CHECK(graph->fixed == std::vector<std::uint8_t>{1, 0});
  REQUIRE(graph->vertices.size() == 2);
  CHECK(graph->vertices[1].translation() == vec3(4, 5, 6));
  CHECK(graph->vertices[1].rotation().unit_quaternion().z() == Approx(0.6));
  REQUIRE(graph->edges.size() == 1);
  const io::g2o_edge& e = graph->edges[0];
  CHECK(e.from == 0);
  CHECK(e.to == 1);
  CHECK(e.measurement.translation() == vec3(0.5, 0, 0));
  CHECK(e.measurement.rotation().unit_quaternion().z() == 1.0);  // normalised
  CHECK(e.information == e.information.transpose());
  CHECK(e.information(0, 5) == 6.0);
  CHECK(e.information(1, 1) == 7.0);
  CHECK(e.information(4, 5) == 20.0);
  CHECK(e.information(5, 5) == 21.0);

  const auto empty = parse_g2o("");
  REQUIRE(empty.has_value());
  CHECK(empty->vertices.empty());
  const auto fixed = parse_g2o("FIX 1 2\nVERTEX_SE3:QUAT 2 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 0 0 0 0 0 0 1");
  REQUIRE(fixed.has_value());
  CHECK(fixed->fixed == std::vector<std::uint8_t>{1, 1});
}

TEST_CASE("What is written is read back to the bit") {
  auto made = test::make_pose_graph({.poses_per_turn = 9, .turns = 7}).measured;
  made.ids[3] = std::numeric_limits<std::int64_t>::max();
  made.ids[4] = std::numeric_limits<std::int64_t>::min();
  made.fixed[5] = 1;
  made.edges[2].information(0, 5) = made.edges[2].information(5, 0) = 1.0 / 3.0;
  const test::temporary_folder folder;
  REQUIRE(io::write_g2o(folder / "graph.g2o", made).has_value());
  const auto again = io::read_g2o(folder / "graph.g2o");
  REQUIRE(again.has_value());
  CHECK(again->ids == made.ids);
  CHECK(again->fixed == made.fixed);
  REQUIRE(again->vertices.size() == made.vertices.size());
  for (std::size_t i = 0; i != made.vertices.size(); ++i) {
    CHECK(again->vertices[i].translation() == made.vertices[i].translation());
    CHECK((again->vertices[i].rotation().unit_quaternion().coeffs() -
           made.vertices[i].rotation().unit_quaternion().coeffs())
              .norm() < 1e-15);
  }
  REQUIRE(again->edges.size() == made.edges.size());
  for (std::size_t k = 0; k != made.edges.size(); ++k) {
    CHECK(again->edges[k].from == made.edges[k].from);
    CHECK(again->edges[k].to == made.edges[k].to);
    CHECK(again->edges[k].measurement.translation() == made.edges[k].measurement.translation());
    CHECK(again->edges[k].information == made.edges[k].information);
  }
}

TEST_CASE("Damaged g2o files say in which line and what is wrong") {
  const std::string vertices = "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 0 0 0 0 0 0 1\n";
  const std::string edge = "EDGE_SE3:QUAT 0 1 0 0 0 0 0 0 1";
  refused("VERTEX_SE3:QUAT\n", errc::malformed, "1", "id");
  refused("VERTEX_SE3:QUAT one 0 0 0 0 0 0 1\n", errc::malformed, "1", "\"one\"");
  refused("VERTEX_SE3:QUAT 1.5 0 0 0 0 0 0 1\n", errc::malformed, "1", "\"1.5\"");
  refused("VERTEX_SE3:QUAT 99999999999999999999 0 0 0 0 0 0 1\n", errc::malformed, "1", "id");
  refused("VERTEX_SE3:QUAT 0 0 0 0 0 0 0\n", errc::malformed, "1", "7 numbers");
  refused("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1 5\n", errc::malformed, "1", "\"5\"");
  refused("VERTEX_SE3:QUAT 0 0 nan 0 0 0 0 1\n", errc::malformed, "1", "finite");
  refused("VERTEX_SE3:QUAT 0 0 1e999 0 0 0 0 1\n", errc::malformed, "1", "number");
  refused("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 0\n", errc::malformed, "1", "quaternion");
  refused(vertices + "\nVERTEX_SE3:QUAT 1 0 0 0 0 0 0 1\n", errc::malformed, "4", "vertex 1 is defined twice");
  refused(vertices + edge + "\n", errc::malformed, "3", "21 numbers");
  refused(vertices + edge + information.substr(0, information.size() - 3), errc::malformed, "3", "21 numbers");
  refused(vertices + edge + information + " 22\n", errc::malformed, "3", "\"22\"");
  refused("EDGE_SE3:QUAT 0 3 0 0 0 0 0 0 1" + information + "\n" + vertices, errc::malformed, "1", "vertex 3");
  refused(vertices + "FIX 2\n", errc::malformed, "3", "vertex 2");
  refused(vertices + "FIX\n", errc::malformed, "3", "id");
  refused("VERTEX_SE2 0 0 0 0\n", errc::unsupported, "1", "VERTEX_SE2");
  refused("\x01\x02\xff garbage\n", errc::unsupported, "1", "\"???\"");

  const test::temporary_folder folder;
  const auto missing = io::read_g2o(folder / "no.g2o");
  REQUIRE_FALSE(missing.has_value());
  CHECK(missing.error().code == errc::not_found);
  CHECK_FALSE(io::write_g2o(folder / "no" / "graph.g2o", {}).has_value());
}

TEST_CASE("sphere.g2o is read whole") {
  ORBIS_NEEDS_DATA("pose_graph/sphere.g2o");
  const auto graph = io::read_g2o(test::data_dir() / "pose_graph/sphere.g2o");
  REQUIRE(graph.has_value());
  CHECK(graph->vertices.size() == 2500);
  CHECK(graph->edges.size() == 9799);
  CHECK(graph->edges.back().information.diagonal() == (vec6() << 1e4, 1e4, 1e4, 4e4, 4e4, 4e4).finished());
}

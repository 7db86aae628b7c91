// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>

#include <orbis/io/bal.hpp>

#include "support/catch.hpp"
#include "support/data.hpp"
#include "support/temporary_folder.hpp"

using namespace orbis;
using io::parse_bal;

namespace {

const std::string observations =
    "2 1 3\n"
    "0 0   -3.5e+00 +2\n"
    "1 0 10.25 -1e-3\r\n"
    "1 0\t7 8\n";
const std::string cameras =
    "0.1\n0.2\n-0.3\n1\n2\n3\n500\n-1e-7\n2e-13\n"
    "0 0 0 0 0 0 400 0 0\n";
const std::string small = observations + cameras + "\n1.5\n-2.5\n-7\n\n";

/// Parsing fails with this kind of error, and a message that names line and reason.
void refused(const std::string& text, const std::string& line, const std::string& what, errc code = errc::malformed) {
  const auto problem = parse_bal(text, "some.txt");
  INFO(text);
  REQUIRE_FALSE(problem.has_value());
  CHECK(problem.error().code == code);
  CHECK(problem.error().where == "some.txt:" + line);
  INFO(problem.error().message);
  CHECK(problem.error().message.find(what) != std::string::npos);
  CHECK(problem.error().message.find('\n') == std::string::npos);
}

bool equal(const io::bal_problem& a, const io::bal_problem& b) {
  if (a.cameras != b.cameras || a.points != b.points || a.observations.size() != b.observations.size()) return false;
  for (std::size_t k = 0; k != a.observations.size(); ++k) {
    const auto &x = a.observations[k], &y = b.observations[k];
    if (x.camera != y.camera || x.point != y.point || x.pixel != y.pixel) return false;
  }
  return true;
}

/// Half the sum of squared residuals.
double cost_of(const io::bal_problem& p) {
  double sum = 0.0;
  for (const auto& o : p.observations)
    sum += 0.5 * (io::project_bal(p.cameras[o.camera], p.points[o.point]).value() - o.pixel).squaredNorm();
  return sum;
}

}  // namespace

TEST_CASE("A BAL problem is read, whatever blanks are between its numbers") {
  const auto problem = parse_bal(small);
  REQUIRE(problem.has_value());
  REQUIRE(problem->observations.size() == 3);
  CHECK(problem->observations[0].camera == 0);
  CHECK(problem->observations[0].pixel == vec2(-3.5, 2.0));
  CHECK(problem->observations[1].camera == 1);
  CHECK(problem->observations[1].point == 0);
  CHECK(problem->observations[1].pixel == vec2(10.25, -1e-3));
  CHECK(problem->observations[2].pixel == vec2(7, 8));
  REQUIRE(problem->cameras.size() == 2);
  CHECK(problem->cameras[0] == std::array<double, 9>{0.1, 0.2, -0.3, 1, 2, 3, 500, -1e-7, 2e-13});
  CHECK(problem->cameras[1] == std::array<double, 9>{0, 0, 0, 0, 0, 0, 400, 0, 0});
  CHECK(problem->points == std::vector<vec3>{vec3(1.5, -2.5, -7)});

  std::string one_line = "\xEF\xBB\xBF" + small;
  for (char& c : one_line)
    if (c == '\n' || c == '\r') c = ' ';
  const auto again = parse_bal(one_line);
  REQUIRE(again.has_value());
  CHECK(equal(*again, *problem));
  std::istringstream stream{small};
  const auto streamed = io::read_bal(stream);
  REQUIRE(streamed.has_value());
  CHECK(equal(*streamed, *problem));

  const auto empty = parse_bal("0 0 0");
  REQUIRE(empty.has_value());
  CHECK(empty->cameras.empty());
}

TEST_CASE("A BAL problem that is written is read back to the bit") {
  auto problem = parse_bal(small).value();
  problem.cameras[0][0] = 1.0 / 3.0;
  problem.cameras[1][8] = std::numeric_limits<double>::denorm_min();
  problem.points[0].y() = -std::numeric_limits<double>::max();
  problem.observations[2].pixel.x() = std::nextafter(1.0, 2.0);
  const test::temporary_folder folder;
  REQUIRE(io::write_bal(folder / "problem.txt", problem).has_value());
  const auto again = io::read_bal(folder / "problem.txt");
  REQUIRE(again.has_value());
  CHECK(equal(*again, problem));
  CHECK_FALSE(io::write_bal(folder / "no" / "problem.txt", problem).has_value());
}

TEST_CASE("Damaged BAL files say in which line and what is wrong") {
  refused("", "1", "begin with");
  refused("\n\n3 4", "3", "begin with");
  refused("two 3 4\n", "1", "\"two\"");
  refused("-2 3 4\n", "1", "\"-2\"");
  refused("2 1.5 4\n", "1", "\"1.5\"");
  refused("99999999999999999999 1 1\n", "1", "begin with");
  refused("4000000000 1 1\n", "1", "4000000000 cameras");  // and asks for no memory
  refused("1 18446744073709551615 18446744073709551615\n", "1", "points");
  refused("1 1 1000\n" + observations, "1", "1000 observations");
  refused("2 1 1\n2 0 1 1\n" + cameras + "1 2 3", "2", "camera 2");
  refused("2 1 1\n1 1 1 1\n" + cameras + "1 2 3", "2", "point 1");
  refused("2 1 1\n-1 0 1 1\n" + cameras + "1 2 3", "2", "\"-1\", which is not an index");
  refused("2 1 1\n0.5 0 1 1\n" + cameras + "1 2 3", "2", "\"0.5\"");
  refused("2 1 1\n0 0 one 1\n" + cameras + "1 2 3", "2", "\"one\", which is not a number");
  refused("2 1 1\n0 0 1 nan\n" + cameras + "1 2 3", "2", "not finite");
  refused("2 1 1\n0 0 1 1\n" + cameras + "1 -inf 3", "13", "not finite");
  refused("2 1 1\n0 0 1 1\n" + cameras + "1 1e999 3", "13", "point 0");
  refused("2 1 1\n0 0 1 1\n" + cameras + "1 2 0x3", "13", "\"0x3\"");
  refused("2 1 1\n0 0 1 1\n" + cameras + "1 2", "13", "ends early: point 0");
  refused("2 1 1\n0 0 1 1e\n" + cameras + "1 2 3", "2", "\"1e\"");
  refused(small + "4\n", "20", "\"4\"");
  refused(small + "\x01\xff\n", "20", "\"??\"");
  refused("BZh91AY&SY", "1", "unpack it", errc::unsupported);
  refused("\x1f\x8b\x08", "1", "unpack it", errc::unsupported);
  // Cut anywhere, it is no problem any more (but in the last number, which is one still).
  for (std::size_t length = 0; length != small.find("-7"); ++length)
    CHECK_FALSE(parse_bal(small.substr(0, length)).has_value());

  const test::temporary_folder folder;
  const auto missing = io::read_bal(folder / "no.txt");
  REQUIRE_FALSE(missing.has_value());
  CHECK(missing.error().code == errc::not_found);
}

TEST_CASE("A problem of the BAL collection has the cost that is known of it") {
  const std::string name = "bal/bal-ladybug-problem-49-7776-pre-shrink-1800.txt";
  ORBIS_NEEDS_DATA(name);
  const auto problem = io::read_bal(test::data_dir() / name);
  REQUIRE(problem.has_value());
  CHECK(problem->cameras.size() == 49);
  CHECK(problem->points.size() == 1800);
  CHECK(problem->observations.size() == 10863);
  CHECK(cost_of(*problem) == Approx(2.345198e5).epsilon(1e-6));
  CHECK(equal(parse_bal(io::format_bal(*problem)).value(), *problem));
}

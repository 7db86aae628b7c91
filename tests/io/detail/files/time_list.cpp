// SPDX-License-Identifier: BSD-3-Clause
#include <string>
#include <vector>

#include <orbis/io/detail/files/time_list.hpp>

#include "support/catch.hpp"

TEST_CASE("a list of times has one time per line, ascending") {
  const auto parse = [](const char* text) { return orbis::io::detail::parse_times(text, "times.txt"); };
  CHECK(parse("# seconds\n0\n\n0.5\r\n1e1").value() == std::vector<double>{0.0, 0.5, 10.0});
  CHECK(parse("1403715529000000000\n").value() == std::vector<double>{1403715529.0});
  CHECK(parse("").value().empty());
  for (const char* bad : {"0\n0\n", "1\n0.5\n", "0\nx\n", "0\n1 2\n", "0\nnan\n"}) {
    const auto times = parse(bad);
    REQUIRE_FALSE(times);
    CHECK(times.error().code == orbis::errc::malformed);
    CHECK(times.error().to_string() == "times.txt:2: a line must have one time, later than the previous one");
  }
}

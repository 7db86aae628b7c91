// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <orbis/io/detail/text.hpp>

#include "support/catch.hpp"

namespace io = orbis::io;

TEST_CASE("lines are numbered from 1 and come without comments and blanks and line ends") {
  std::vector<std::pair<std::string, std::size_t>> seen;
  io::detail::for_each_line("\xEF\xBB\xBF# head\r\n a b \r\n\r\n\t# more\n c\nd",
                            [&](std::string_view line, std::size_t n) {
                              seen.emplace_back(line, n);
                              return true;
                            });
  CHECK(seen == std::vector<std::pair<std::string, std::size_t>>{{"a b", 2}, {"c", 5}, {"d", 6}});
}

TEST_CASE("visiting lines stops when told to") {
  int count = 0;
  io::detail::for_each_line("a\nb\nc\n", [&](std::string_view, std::size_t) { return ++count < 2; });
  CHECK(count == 2);
}

TEST_CASE("a number is all of its field or none of it") {
  double d = 0.0;
  CHECK((io::detail::parse_number("1e-3", d) && d == 1e-3));
  CHECK((io::detail::parse_number("+2.5", d) && d == 2.5));
  CHECK((io::detail::parse_number("nan", d) && std::isnan(d)));
  for (const char* bad : {"", "+", "-", "+-1", "1x", "1,5", " 1", "1 ", "0x10", "1e999"})
    CHECK_FALSE(io::detail::parse_number(bad, d));
  unsigned u = 0;
  CHECK((io::detail::parse_number("000042", u) && u == 42));
  CHECK_FALSE(io::detail::parse_number("-1", u));
  CHECK_FALSE(io::detail::parse_number("4294967296", u));
}

TEST_CASE("fields are taken one by one") {
  std::string_view text = "  1305.5\trgb/a b.png ";
  CHECK(io::detail::next_field(text) == "1305.5");
  CHECK(io::detail::trimmed(text) == "rgb/a b.png");
  text = " \r\n";
  CHECK(io::detail::next_field(text).empty());
}

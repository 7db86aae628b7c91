// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <string>

#include <orbis/core/quote.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("quotations are short, in one line, and end between characters") {
  CHECK(in_quotes("") == "\"\"");
  CHECK(in_quotes("a word") == "\"a word\"");
  CHECK(in_quotes("a\nb\x7f\tc") == "\"a?b??c\"");
  CHECK(in_quotes("\x01\x02\xff") == "\"???\"");  // not UTF-8
  CHECK(in_quotes("\u0080\u009f\u00a0") == "\"??\u00a0\"");
  CHECK(in_quotes("\u2027\u2028\u2029\u202a\u202e\u202f") == "\"\u2027????\u202f\"");
  CHECK(in_quotes("\u2065\u2066\u2069\u206a") == "\"\u2065??\u206a\"");
  CHECK(in_quotes("K\xC3\xBC"
                  "che") ==
        "\"K\xC3\xBC"
        "che\"");
  const std::string long_text(2000, 'x');
  const auto begins = [&](const std::string& text, std::size_t length, const std::string& end) {
    return text.size() == length + end.size() && text.starts_with(long_text.substr(0, length)) && text.ends_with(end);
  };
  CHECK(begins(in_quotes(long_text).substr(1), 60, "...\""));
  CHECK(begins(shortened(long_text), 200, "..."));
  CHECK(shortened(std::string(200, 'x')) == std::string(200, 'x'));
  CHECK(shortened("abc\xC3\xBC", 4) == "abc...");  // not half of a character
  CHECK(shortened("\xC3\xBC", 1) == "...");
  CHECK(shortened_path("/a/b") == "/a/b");
  CHECK(shortened_path(long_text + "/a.txt:7", 10) == "...xx/a.txt:7");
  CHECK(shortened_path("abc\xC3\xBC"
                       "def",
                       4) == "...def");
}

// SPDX-License-Identifier: BSD-3-Clause
#include <string>
#include <string_view>

#include <orbis/core/utf8.hpp>

#include "support/catch.hpp"

using namespace std::string_view_literals;
using orbis::is_utf8;

TEST_CASE("text in UTF-8 is told from other bytes") {
  for (const auto text : {""sv, "plain"sv, "\0"sv, "\x7f"sv, "\xc2\x80"sv, "\xdf\xbf"sv, "\xe0\xa0\x80"sv,
                          "\xed\x9f\xbf"sv, "\xee\x80\x80"sv, "\xef\xbf\xbf"sv, "\xf0\x90\x80\x80"sv,
                          "\xf4\x8f\xbf\xbf"sv, "a\xc3\xa4 \xe2\x82\xac \xf0\x9f\xa4\x96 z"sv}) {
    CAPTURE(text);
    CHECK(is_utf8(text));
  }
  for (const auto text :
       {"\x80"sv, "\xbf"sv, "\xc0\x80"sv, "\xc1\xbf"sv, "\xc2"sv, "\xc2\x41"sv, "\xe0\x9f\xbf"sv, "\xe2\x82"sv,
        "\xe2\x82\x41"sv, "\xed\xa0\x80"sv, "\xed\xbf\xbf"sv, "\xf0\x8f\xbf\xbf"sv, "\xf0\x9f\xa4"sv,
        "\xf4\x90\x80\x80"sv, "\xf5\x80\x80\x80"sv, "\xff"sv, "disttroion\xe5 0.1"sv}) {
    CAPTURE(text);
    CHECK_FALSE(is_utf8(text));
    CHECK_FALSE(is_utf8("before " + std::string{text} + " after"));
  }
}

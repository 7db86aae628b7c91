// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <string>

#include <orbis/core/base85.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("bytes come back from text, and the text can stand in a literal") {
  random_bits random{1};
  std::string bytes;
  for (int length = 0; length != 200; ++length) {
    const std::string text = to_base85(bytes);
    CHECK(text.find_first_of("\"\\?\n ") == std::string::npos);
    std::string again = "before";
    REQUIRE(append_base85(again, text));
    CHECK(again.size() == 6 + (bytes.size() + 3) / 4 * 4);
    CHECK(again.substr(6, bytes.size()) == bytes);
    bytes += static_cast<char>(length % 3 == 0 ? 0xff : random());
  }
  for (const char c : to_base85(std::string(400, '\xff'))) CHECK((c > ' ' && c < '\x7f'));
}

TEST_CASE("text that stands for no bytes is refused") {
  std::string bytes;
  CHECK_FALSE(append_base85(bytes, "1234"));
  CHECK_FALSE(append_base85(bytes, "1234\""));
  CHECK_FALSE(append_base85(bytes, "wwwww"));  // more than four bytes hold
  CHECK(append_base85(bytes, "#####"));
}

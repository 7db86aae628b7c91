// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/cloud/detail/select/in_words.hpp>

#include "support/catch.hpp"

TEST_CASE("numbers stand in reasons with three digits") {
  using orbis::cloud::detail::in_words;
  CHECK(in_words(0.0) == "0");
  CHECK(in_words(12.3456) == "12.3");
  CHECK(in_words(0.00012345) == "0.000123");
  CHECK(in_words(1234567.0) == "1.23e+06");
  CHECK(orbis::cloud::detail::percent(0.1234) == "12.3 %");
}

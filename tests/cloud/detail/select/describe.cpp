// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/cloud/detail/select/describe.hpp>

#include "support/catch.hpp"

TEST_CASE("numbers in reasons have three significant digits") {
  using orbis::cloud::detail::describe;
  CHECK(describe(0.0) == "0");
  CHECK(describe(12.3456) == "12.3");
  CHECK(describe(0.00012345) == "0.000123");
  CHECK(describe(1234567.0) == "1.23e+06");
  CHECK(orbis::cloud::detail::percent(0.1234) == "12.3 %");
}

// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/core/inline.hpp>

#include "support/catch.hpp"

ORBIS_INLINE int twice(int x) { return 2 * x; }

TEST_CASE("a function marked as inline can be called and has an address") {
  int (*const f)(int) = &twice;
  CHECK(f(21) == 42);
}

// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <vector>

#include <orbis/eval/statistics.hpp>

#include "support/catch.hpp"

namespace eval = orbis::eval;

TEST_CASE("the statistics of a few errors are those done by hand") {
  const auto s = eval::summarize({3.0, 1.0, 2.0, 4.0});
  CHECK(s.count == 4);
  CHECK(s.mean == 2.5);
  CHECK(s.median == 2.5);
  CHECK(s.rmse == Approx(std::sqrt(7.5)));
  CHECK(s.p95 == Approx(3.85));
  CHECK(s.max == 4.0);
  const auto one = eval::summarize({2.0});
  CHECK(one.median == 2.0);
  CHECK(one.p95 == 2.0);
  CHECK(eval::summarize({}).count == 0);
}

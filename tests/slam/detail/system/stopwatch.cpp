// SPDX-License-Identifier: BSD-3-Clause
#include <chrono>
#include <thread>

#include <orbis/slam/detail/system/stopwatch.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("A stopwatch measures from lap to lap") {
  slam::detail::stopwatch clock;
  double first = -1.0, second = -1.0;
  std::this_thread::sleep_for(std::chrono::milliseconds{20});
  clock.lap(first);
  clock.lap(second);
  CHECK(first >= 20.0);
  CHECK(second >= 0.0);
  CHECK(second < first);
}

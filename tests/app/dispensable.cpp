// SPDX-License-Identifier: BSD-3-Clause
//
// Work that is given up after a signal. One case, as signals change the state of the process.
#include "dispensable.hpp"

#include <atomic>
#include <chrono>
#include <csignal>
#include <memory>
#include <stdexcept>
#include <thread>

#include <unistd.h>

#include "interrupts.hpp"
#include "support/catch.hpp"

using namespace app;
using std::chrono::milliseconds;

TEST_CASE("Work that ignores that it is given up is left behind") {
  using clock = std::chrono::steady_clock;
  interrupts::start();
  CHECK(run_dispensable([] { return 3; }) == 3);
  CHECK_THROWS_AS(run_dispensable([]() -> int { throw std::runtime_error{"no"}; }), std::runtime_error);

  interrupts::keep_results({});
  interrupts::begin_dispensable({});
  const auto ends = std::make_shared<std::atomic<bool>>(false), ended = std::make_shared<std::atomic<bool>>(false);
  const auto start = clock::now();
  std::thread user{[] {
    std::this_thread::sleep_for(milliseconds{100});
    ::kill(::getpid(), SIGINT);
  }};
  const auto result = run_dispensable([ends, ended] {
    while (!*ends) std::this_thread::sleep_for(milliseconds{1});
    *ended = true;
    return 3;
  });
  user.join();
  CHECK_FALSE(result);
  CHECK(clock::now() - start < milliseconds{2000});
  CHECK_FALSE(*ended);
  CHECK(interrupts::is_given_up());
  CHECK(interrupts::end_dispensable());
  CHECK(interrupts::is_given_up());  // the work is left behind

  *ends = true;
  for (int i = 0; i != 2000 && !*ended; ++i) std::this_thread::sleep_for(milliseconds{1});
  CHECK(*ended);
  // Work that ends within a moment is kept.
  CHECK(run_dispensable([] { return std::this_thread::sleep_for(milliseconds{100}), 4; }) == 4);
}

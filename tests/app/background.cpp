// SPDX-License-Identifier: BSD-3-Clause
#include "background.hpp"

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>

#include "support/catch.hpp"

TEST_CASE("A background thread does one piece of work after another and passes on exceptions") {
  app::background_thread thread;
  CHECK(thread.start([] { return 7; }).get() == 7);
  auto fails = thread.start([]() -> int { throw std::runtime_error{"no"}; });
  CHECK_THROWS_AS(fails.get(), std::runtime_error);
  const auto id = thread.start([] { return std::this_thread::get_id(); }).get();
  CHECK(id == thread.start([] { return std::this_thread::get_id(); }).get());
  CHECK(id != std::this_thread::get_id());
}

TEST_CASE("The end of a background thread waits for its work") {
  std::atomic<bool> is_done{false};
  {
    app::background_thread thread;
    static_cast<void>(thread.start([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds{20});
      is_done = true;
    }));
  }
  CHECK(is_done);
  const app::background_thread unused;
}

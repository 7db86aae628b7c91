// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <type_traits>
#include <vector>

#include <orbis/core/progress.hpp>

#include "support/catch.hpp"

namespace {

/// Reports each of ten steps; how many it did before it was stopped.
std::size_t ten_steps(orbis::progress report = {}) {
  for (std::size_t i = 0; i != 10; ++i)
    if (!report(i, 10)) return i;
  return 10;
}

bool stop_at_three(std::size_t done, std::size_t) { return done != 3; }

}  // namespace

TEST_CASE("without a callback everything runs to its end") {
  CHECK(ten_steps() == 10);
  CHECK(!orbis::progress{});
}

TEST_CASE("a callback sees every report and can cancel") {
  std::vector<std::size_t> seen;
  CHECK(ten_steps([&](std::size_t done, std::size_t total) {
          CHECK(total == 10);
          seen.push_back(done);
          return true;
        }) == 10);
  CHECK(seen.size() == 10);
  CHECK(ten_steps([](std::size_t done, std::size_t) { return done < 4; }) == 4);
}

TEST_CASE("lvalue and const callables are used in place and copies of a progress share them") {
  int calls = 0;
  auto count = [&calls](std::size_t, std::size_t) mutable {
    ++calls;
    return true;
  };
  const orbis::progress report{count};
  const orbis::progress copy = report;
  CHECK(static_cast<bool>(copy));
  CHECK(report(0, 1));
  CHECK(copy(0, 1));
  CHECK(calls == 2);
  const auto constant = [](std::size_t done, std::size_t) { return done == 0; };
  CHECK(ten_steps(constant) == 1);
  auto* function = &stop_at_three;
  CHECK(ten_steps(function) == 3);
  CHECK(ten_steps(stop_at_three) == 3);
}

TEST_CASE("what is not a callback is not taken for one") {
  static_assert(!std::is_convertible_v<int, orbis::progress>);
  static_assert(!std::is_convertible_v<decltype([](int*) { return true; }), orbis::progress>);
  static_assert(std::is_convertible_v<decltype([](std::size_t, std::size_t) { return true; }), orbis::progress>);
}

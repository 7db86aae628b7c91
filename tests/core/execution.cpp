// SPDX-License-Identifier: BSD-3-Clause
#include <atomic>
#include <cstddef>
#include <numeric>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <orbis/core/execution.hpp>

#include "support/catch.hpp"

TEST_CASE("every index is visited once under every policy") {
  for (const std::size_t count : {0U, 1U, 7U, 8U, 9U, 1000U}) {
    std::vector<int> visits(count, 0);
    const auto visit = [&](std::size_t i) { ++visits[i]; };
    orbis::for_each_index(orbis::seq, count, 8, visit);
    orbis::for_each_index(orbis::par, count, 8, visit);
    orbis::for_each_index(orbis::par.with(5), count, 8, visit);
    CHECK(std::accumulate(visits.begin(), visits.end(), 0) == static_cast<int>(3 * count));
    for (const int v : visits) CHECK(v == 3);
  }
}

TEST_CASE("chunks do not depend on the number of threads") {
  const auto chunks = [](const auto& policy) {
    std::vector<std::size_t> ends(10, 0);
    orbis::for_each_chunk(policy, 95, 10, [&](std::size_t b, std::size_t e) { ends[b / 10] = e; });
    return ends;
  };
  CHECK(chunks(orbis::seq) == chunks(orbis::par.with(4)));
}

#if defined(__has_feature)
#define ORBIS_TEST_SANITIZED (__has_feature(address_sanitizer) || __has_feature(thread_sanitizer))
#elif defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define ORBIS_TEST_SANITIZED 1
#else
#define ORBIS_TEST_SANITIZED 0
#endif
#if !ORBIS_TEST_SANITIZED  // which need their terabytes of addresses
TEST_CASE("work is done on fewer threads where the system gives no more") {
  // In a child with an address space that has no room for the stacks of that many threads.
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    const rlimit limit{rlim_t{512} << 20U, rlim_t{512} << 20U};
    if (setrlimit(RLIMIT_AS, &limit) != 0) _exit(0);
    std::atomic<int> visits{0};
    try {
      orbis::for_each_index(orbis::par.with(2000), 20000, 1, [&](std::size_t) { ++visits; });
    } catch (...) {
      _exit(1);
    }
    _exit(visits == 20000 ? 0 : 2);
  }
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 0);
}
#endif

TEST_CASE("an exception reaches the caller") {
  const auto thrower = [](std::size_t i) {
    if (i == 37) throw std::runtime_error("37");
  };
  CHECK_THROWS_AS(orbis::for_each_index(orbis::seq, 100, 1, thrower), std::runtime_error);
  CHECK_THROWS_AS(orbis::for_each_index(orbis::par.with(3), 100, 1, thrower), std::runtime_error);
}

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

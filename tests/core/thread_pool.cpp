// SPDX-License-Identifier: BSD-3-Clause
#include <atomic>
#include <chrono>
#include <cstddef>
#include <numeric>
#include <stdexcept>
#include <thread>
#include <vector>

#include <orbis/core/execution.hpp>

#include "support/catch.hpp"

using orbis::thread_pool;

TEST_CASE("a pool's threads visit every index once, loop after loop") {
  for (const unsigned threads : {1U, 2U, 3U, 8U}) {
    thread_pool pool{threads};
    CHECK(pool.threads() == threads);
    CHECK(orbis::par.on(pool).threads() == threads);
    CHECK(orbis::par.on(pool).with(2).threads() == 2);
    std::size_t wrong = 0;
    for (std::size_t loop = 0; loop != 3000; ++loop) {
      const std::size_t count = loop % 50;
      std::vector<int> visits(count, 0);
      orbis::for_each_index(orbis::par.on(pool), count, 3, [&](std::size_t i) { ++visits[i]; });
      for (const int v : visits) wrong += v != 1 ? 1 : 0;
    }
    CHECK(wrong == 0);
  }
}

namespace {

/// How many threads are in a loop at a time: each waits, at most `patience`, until `wanted` have been.
unsigned at_a_time(const orbis::parallel_policy& policy, unsigned wanted, std::chrono::milliseconds patience) {
  const auto end = std::chrono::steady_clock::now() + patience;
  std::atomic<unsigned> at_work{0}, seen{0};
  orbis::for_each_index(policy, 50, 1, [&](std::size_t) {
    const unsigned now = ++at_work;
    unsigned before = seen.load();
    while (before < now && !seen.compare_exchange_weak(before, now)) {
    }
    while (seen < wanted && std::chrono::steady_clock::now() < end) std::this_thread::yield();
    --at_work;
  });
  return seen;
}

}  // namespace

TEST_CASE("a pool lets as many threads work as the policy says, and no more") {
  thread_pool pool{4};
  for (const unsigned most : {1U, 2U, 3U}) {
    CHECK(at_a_time(orbis::par.on(pool).with(most), most, std::chrono::seconds{20}) == most);
    CHECK(at_a_time(orbis::par.on(pool).with(most), most + 1, std::chrono::milliseconds{20}) == most);
  }
}

TEST_CASE("threads of a pool that sleep wake up for every loop") {
  thread_pool pool{2};
  for (int loop = 0; loop != 300; ++loop) {
    if (loop % 3 != 0) std::this_thread::sleep_for(std::chrono::microseconds{20 * (loop % 20)});
    REQUIRE(at_a_time(orbis::par.on(pool), 2, std::chrono::seconds{20}) == 2);
  }
}

TEST_CASE("threads that find their pool busy, and loops inside of loops, do their work themselves") {
  thread_pool pool{3};
  std::vector<long> sums(6, 0);
  {
    std::vector<std::jthread> callers;
    for (std::size_t c = 0; c != sums.size(); ++c) {
      callers.emplace_back([&, c] {
        for (int loop = 0; loop != 200; ++loop) {
          std::atomic<long> sum{0};
          orbis::for_each_index(orbis::par.on(pool), 10, 1, [&](std::size_t i) {
            orbis::for_each_index(orbis::par.on(pool), 10, 1,
                                  [&](std::size_t j) { sum += static_cast<long>(10 * i + j); });
          });
          sums[c] += sum;
        }
      });
    }
  }
  for (const long sum : sums) CHECK(sum == 200 * 4950);
}

TEST_CASE("an exception on a pool's thread reaches the caller, and the pool goes on") {
  thread_pool pool{3};
  for (int loop = 0; loop != 50; ++loop)
    CHECK_THROWS_AS(orbis::for_each_index(orbis::par.on(pool), 1000, 1,
                                          [&](std::size_t i) {
                                            if (i == 500) throw std::runtime_error{"stop"};
                                          }),
                    std::runtime_error);
  std::vector<int> visits(1000, 0);
  orbis::for_each_index(orbis::par.on(pool), visits.size(), 1, [&](std::size_t i) { ++visits[i]; });
  CHECK(std::accumulate(visits.begin(), visits.end(), 0) == 1000);
}

TEST_CASE("a pool may end while its threads sleep, or before they have begun") {
  for (int i = 0; i != 50; ++i) thread_pool{4};
  thread_pool pool{4};
  std::this_thread::sleep_for(std::chrono::milliseconds{5});
  std::atomic<int> calls{0};
  orbis::for_each_index(orbis::par.on(pool), 100, 1, [&](std::size_t) { ++calls; });
  CHECK(calls == 100);
}

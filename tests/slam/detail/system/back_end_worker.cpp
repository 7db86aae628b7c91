// SPDX-License-Identifier: BSD-3-Clause
#include <atomic>
#include <stdexcept>
#include <thread>
#include <vector>

#include <orbis/slam/detail/system/back_end.hpp>

#include "support/catch.hpp"

using orbis::slam::detail::worker;

TEST_CASE("What a job throws comes to those who wait and to those who push") {
  std::vector<int> done;
  worker<int> w{[&](int job) {
    if (job == 2) throw std::runtime_error{"no memory"};
    done.push_back(job);
  }};
  for (const int job : {0, 1, 2, 3, 4}) {
    try {
      w.push(job);
    } catch (const std::runtime_error&) {
      CHECK(job > 2);
    }
  }
  CHECK_THROWS_AS(w.wait(), std::runtime_error);
  CHECK_THROWS_AS(w.wait_for_room(1), std::runtime_error);
  CHECK_THROWS_AS(w.push(5), std::runtime_error);
  CHECK(w.idle());
  CHECK(done == std::vector<int>{0, 1});
  w.stop();
}

TEST_CASE("A job that waits already is not pushed twice, one that runs is") {
  std::atomic<bool> begun{false}, may_end{false};
  std::vector<int> done;
  worker<int> w{[&](int job) {
    begun = true;
    while (!may_end) std::this_thread::yield();
    done.push_back(job);
  }};
  w.push_once(1);
  while (!begun) std::this_thread::yield();
  for (const int job : {1, 2, 1, 2, 3, 2}) w.push_once(job);
  CHECK(w.waiting() == 3);
  may_end = true;
  w.wait();
  CHECK(done == std::vector<int>{1, 1, 2, 3});
}

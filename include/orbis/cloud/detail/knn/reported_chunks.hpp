// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A parallel loop that reports how far it is and can be called off.
#pragma once

#include <atomic>
#include <cstddef>
#include <mutex>

#include <orbis/core/execution.hpp>
#include <orbis/core/result.hpp>

namespace orbis::cloud::detail {

/// `for_each_chunk` that reports the elements done after each chunk, from one thread at a time. False if the
/// callback asked to stop: what is begun is finished then, the rest left out.
template <execution_policy Policy, class Body>
[[nodiscard]] bool for_each_reported_chunk(const Policy& policy, std::size_t count, std::size_t grain,
                                           const progress& report, Body&& body) {
  if (!report) {
    for_each_chunk(policy, count, grain, body);
    return true;
  }
  std::atomic<bool> stopped{false};
  std::mutex guard;
  std::size_t done = 0;
  for_each_chunk(policy, count, grain, [&](std::size_t begin, std::size_t end) {
    if (stopped.load(std::memory_order_relaxed)) return;
    body(begin, end);
    const std::lock_guard lock{guard};
    done += end - begin;
    if (!stopped.load(std::memory_order_relaxed) && !report(done, count)) stopped = true;
  });
  return !stopped;
}

[[nodiscard]] inline auto fail_cancelled() { return fail(errc::cancelled, {}, "cancelled"); }

}  // namespace orbis::cloud::detail

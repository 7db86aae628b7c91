// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Work that the user can abandon at any time.
#pragma once

#include <chrono>
#include <exception>
#include <future>
#include <memory>
#include <optional>
#include <system_error>
#include <thread>
#include <type_traits>
#include <utility>

#include "interrupts.hpp"

namespace app {

/// Calls `work()` on another thread. Returns its result or rethrows its exception. The result is empty if the work was
/// abandoned (`interrupts::is_given_up`) and does not end promptly by itself. The work is then still running, so all
/// data to which it refers must outlive it, and the program must end through `interrupts::end_program`. If no thread
/// can be created, calls `work` on the current thread.
template <class Work>
[[nodiscard]] std::optional<std::invoke_result_t<Work&>> run_dispensable(Work work) {
  constexpr std::chrono::milliseconds poll_interval{20}, moment{500};
  struct job {
    Work work;
    std::promise<std::invoke_result_t<Work&>> result{};
  };
  const auto shared = std::make_shared<job>(job{std::move(work)});
  auto result = shared->result.get_future();
  std::thread worker;
  try {
    worker = std::thread{[shared] {
      try {
        shared->result.set_value(shared->work());
      } catch (...) {
        shared->result.set_exception(std::current_exception());
      }
    }};
  } catch (const std::system_error&) {
    return shared->work();
  }
  const auto is_ready = [&](auto time) { return result.wait_for(time) == std::future_status::ready; };
  while (!is_ready(poll_interval))
    if (interrupts::is_given_up()) {
      if (is_ready(moment)) break;
      worker.detach();
      return std::nullopt;
    }
  worker.join();
  return result.get();
}

}  // namespace app

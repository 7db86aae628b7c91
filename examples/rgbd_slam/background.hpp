// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Starts work on background threads.
#pragma once

#include <future>
#include <system_error>
#include <type_traits>
#include <utility>

namespace app {

/// Starts `work` on a new thread. If no thread can be created, returns a future without state (`valid()` is false), so
/// that the caller does the work.
template <class Work>
[[nodiscard]] std::future<std::invoke_result_t<Work>> start_in_background(Work work) {
  try {
    return std::async(std::launch::async, std::move(work));
  } catch (const std::system_error&) {
    return {};
  }
}

}  // namespace app

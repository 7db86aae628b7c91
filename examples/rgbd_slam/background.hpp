// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Work in the background.
#pragma once

#include <future>
#include <system_error>
#include <type_traits>
#include <utility>

namespace app {

/// Starts `work` on a new thread. If no thread can be created, returns a future without state (`valid()` is false), and
/// the caller does the work.
template <class Work>
[[nodiscard]] std::future<std::invoke_result_t<Work>> start_in_background(Work work) {
  try {
    return std::async(std::launch::async, std::move(work));
  } catch (const std::system_error&) {
    return {};
  }
}

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Work that is done while its caller does something else.
#pragma once

#include <future>
#include <system_error>
#include <type_traits>
#include <utility>

namespace app {

/// Starts `work` on a thread of its own. Without a state (`valid()` is false) if the system gives no thread: the work
/// is then the caller's.
template <class Work>
[[nodiscard]] std::future<std::invoke_result_t<Work>> start_in_background(Work work) {
  try {
    return std::async(std::launch::async, std::move(work));
  } catch (const std::system_error&) {
    return {};
  }
}

}  // namespace app

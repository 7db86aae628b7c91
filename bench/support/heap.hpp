// SPDX-License-Identifier: BSD-3-Clause
//
// How much heap a call takes at its peak, whoever allocates: `malloc` itself is counted.
#pragma once

#include <cstddef>
#include <utility>

namespace orbis::bench {

namespace detail {
void start_counting_heap();
/// The most that was in use at once since the start, bytes, beyond what was in use then.
[[nodiscard]] std::size_t stop_counting_heap();
}  // namespace detail

/// Bytes beyond those in use before, at the worst moment of `work()`. 0 where malloc cannot be counted.
template <class Work>
[[nodiscard]] std::size_t peak_heap(Work&& work) {
  detail::start_counting_heap();
  std::forward<Work>(work)();
  return detail::stop_counting_heap();
}

}  // namespace orbis::bench

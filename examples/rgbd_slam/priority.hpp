// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Threads that give way to tracking where there are fewer cores than threads.
#pragma once

#ifdef __linux__
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

namespace app {

inline constexpr int live_map_niceness = 3;      ///< keyframes are to be in the map soon
inline constexpr int compression_niceness = 10;  ///< nobody waits for it
inline constexpr int viewer_niceness = 10;       ///< it may skip frames; it takes no lock that tracking waits for

/// Makes this thread's share of a busy processor smaller: by a fifth for each step.
inline void lower_priority([[maybe_unused]] int niceness) {
#ifdef __linux__  // where niceness is of the thread, not of the process
  const auto thread = static_cast<id_t>(::syscall(SYS_gettid));
  static_cast<void>(::setpriority(PRIO_PROCESS, thread, ::getpriority(PRIO_PROCESS, thread) + niceness));
#endif
}

}  // namespace app

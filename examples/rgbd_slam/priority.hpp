// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Priorities of background threads, so that tracking takes precedence if there are fewer cores than threads.
#pragma once

#ifdef __linux__
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

namespace app {

inline constexpr int live_map_niceness = 3;  ///< keyframes should appear in the map soon
inline constexpr int viewer_niceness = 10;   ///< the viewer may skip frames, and holds no lock that tracking waits for

/// Reduces this thread's share of a busy processor by one fifth per step of niceness.
inline void lower_priority([[maybe_unused]] int niceness) {
#ifdef __linux__  // on Linux, niceness is a property of the thread, not of the process
  const auto thread = static_cast<id_t>(::syscall(SYS_gettid));
  static_cast<void>(::setpriority(PRIO_PROCESS, thread, ::getpriority(PRIO_PROCESS, thread) + niceness));
#endif
}

}  // namespace app

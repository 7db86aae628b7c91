// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Ctrl-C (SIGINT), SIGTERM, and the closing of the terminal (SIGHUP).
///
/// As long as nothing is worth keeping, the first signal ends the program. While a run collects results, the first
/// signal asks it to stop and to write what it has reached; the second one ends the program at once. Before the program
/// ends by a signal, its temporary files are removed.
#pragma once

#include <functional>
#include <string>

namespace app::interrupts {

/// Starts the thread that waits for signals. Call it before any other thread starts.
void listen();

/// From now on the first signal only makes `requested` true, and shows `notice` on stderr.
void keep_results(std::string notice);
/// From now on the next signal ends the program again.
void end_at_once();
/// Whether a signal asked for the end since `keep_results`.
[[nodiscard]] bool requested();

/// Called on the thread that waits for signals before a signal ends the program; empty: nothing. Returns when no call
/// of the function before is running.
void before_end(std::function<void()> clean_up);

}  // namespace app::interrupts

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Handling of SIGINT (Ctrl-C), SIGTERM and SIGHUP (closed terminal).
///
/// Initially the first signal ends the program. While a run collects results, the first signal asks it to stop and to
/// write its results so far, and the second one ends the program immediately. Before a signal ends the program, its
/// temporary files are removed.
#pragma once

#include <functional>
#include <string>

namespace app::interrupts {

/// Starts the thread that waits for signals. Call it before any other thread starts.
void start();

/// Makes the first signal set `stop_requested` and print `notice` on stderr, instead of ending the program.
void keep_results(std::string notice);
/// Makes the next signal end the program again.
void discard_results();
/// Returns true if a signal arrived after `keep_results`.
[[nodiscard]] bool stop_requested();

/// Sets the function that is called, on the thread that waits for signals, before a signal ends the program; empty:
/// none. Returns when no call of the previous function is running.
void set_clean_up(std::function<void()> clean_up);

}  // namespace app::interrupts

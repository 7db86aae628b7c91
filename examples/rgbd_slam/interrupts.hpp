// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Handling of SIGINT (Ctrl-C), SIGTERM and SIGHUP (closed terminal).
///
/// Initially the first signal ends the program. While a run collects results, the first signal asks it to stop and to
/// write its results so far, and the second one ends the program immediately. Before a signal ends the program, its
/// temporary files are removed.
///
/// Then a run derives further results, which it can give up (`begin_dispensable`). A signal during that time gives them
/// up. After an earlier SIGINT they are completed; after SIGTERM or SIGHUP, whose senders do not wait long, they are
/// given up if they take more than a few seconds.
#pragma once

#include <functional>
#include <string>

namespace app::interrupts {

/// Starts the thread that waits for signals. Call it before any other thread starts.
void start();

/// Makes the first signal set `stop_requested`, print `notice` on stderr and call `on_stop` on the thread that waits
/// for signals, instead of ending the program.
void keep_results(std::string notice, std::function<void()> on_stop = {});
/// Removes `on_stop`. Returns when no call of it is running.
void forget_stop();
/// Returns true if a signal arrived after `keep_results`.
[[nodiscard]] bool stop_requested();

/// Begins work that may be given up; a signal from now on prints `notice` on stderr.
void begin_dispensable(std::string notice);
/// Returns true if that work must be given up.
[[nodiscard]] bool is_given_up();
/// Ends that time. Returns `stop_requested`; a first signal from now on has no effect, as the rest takes moments.
bool end_dispensable();
/// Removes the temporary files and ends the program, although threads are running.
[[noreturn]] void end_program(int code);

/// Sets the function that is called, on the thread that waits for signals, before a signal ends the program; empty:
/// none. Returns when no call of the previous function is running.
void set_clean_up(std::function<void()> clean_up);

}  // namespace app::interrupts

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Handling of SIGINT (Ctrl-C), SIGTERM and SIGHUP (closed terminal).
///
/// Initially, the first signal ends the program. While a run is collecting results, the first signal requests it to
/// stop and to write its results so far, and the second signal ends the program immediately. Before a signal ends the
/// program, the program's temporary files are removed.
///
/// Afterwards, a run derives optional results (`begin_dispensable`). A signal during that time abandons them. If SIGINT
/// arrived earlier, they are completed; if SIGTERM or SIGHUP arrived, whose senders do not wait long, they are
/// abandoned if they take more than a few seconds.
#pragma once

#include <functional>
#include <string>

namespace app::interrupts {

/// Starts the thread that waits for signals. Call it before any other thread starts.
void start();

/// Makes the first signal set `stop_requested`, print `notice` on stderr and call `on_stop` on the thread that waits
/// for signals, instead of ending the program.
void keep_results(std::string notice, std::function<void()> on_stop = {});
/// Removes `on_stop`. Returns when no call to it is running.
void forget_stop();
/// Returns true if a signal arrived after `keep_results`.
[[nodiscard]] bool stop_requested();

/// Marks the start of work that may be abandoned; from then on, a signal prints `notice` on stderr.
void begin_dispensable(std::string notice);
/// Returns true if the work since `begin_dispensable` must be abandoned.
[[nodiscard]] bool is_given_up();
/// Marks the end of the work that may be abandoned. Returns `stop_requested`; from then on, a first signal has no
/// effect, because the rest of the run takes almost no time.
bool end_dispensable();
/// Removes the temporary files and ends the program, even while threads are running.
[[noreturn]] void end_program(int code);

/// Sets the function that is called, on the thread that waits for signals, before a signal ends the program; an empty
/// function disables this. Returns when no call to the previous function is running.
void set_clean_up(std::function<void()> clean_up);

}  // namespace app::interrupts

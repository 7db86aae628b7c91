// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Console output: one line per stage, with a progress bar if stderr is a terminal. Results go to stdout, everything
/// else to stderr.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

#include <orbis/core/execution.hpp>
#include <orbis/core/result.hpp>

#include "interrupts.hpp"

namespace spdlog {
class logger;
}

namespace app {

/// The console of the program. Copies share the terminal line of the progress bar.
class console {
 public:
  using clock = std::chrono::steady_clock;
  explicit console(bool quiet);
  /// A console for work that may be abandoned; once the work is abandoned, the console prints nothing.
  [[nodiscard]] console for_dispensable() const;

  /// Starts a stage, or continues one that began at `start`, and ends the previous one.
  void stage(std::string_view name, clock::time_point start = clock::now());
  /// Shows the progress of the stage and the text `note`. Calls between redraws take almost no time.
  void advance(std::size_t done, std::size_t total, const std::string& note = {});
  /// Ends the stage and prints its outcome.
  void finish(const std::string& outcome);
  /// Seconds since the start of the stage.
  [[nodiscard]] double elapsed() const;
  /// Seconds since the start of the program.
  [[nodiscard]] double total() const;

  /// Returns a progress callback for a library call in this stage. The callback cancels work that was abandoned.
  [[nodiscard]] auto progress() {
    return [this](std::size_t done, std::size_t total) {
      advance(done, total);
      return !interrupts::is_given_up();
    };
  }

  void warn(const std::string& message);
  /// Prints "rgbd_slam: where: message" on one line.
  void error(const orbis::error& e);
  /// Prints a line on stdout, unless quiet; returns false if that fails.
  bool print(const std::string& line);
  [[nodiscard]] bool quiet() const { return quiet_; }

 private:
  [[nodiscard]] bool is_silent() const { return is_dispensable_ && interrupts::is_given_up(); }
  void clear_bar();

  std::shared_ptr<spdlog::logger> log_;
  bool quiet_;
  bool terminal_;
  bool is_dispensable_ = false;
  std::shared_ptr<std::atomic<bool>> bar_shown_ = std::make_shared<std::atomic<bool>>(false);
  std::string stage_;
  clock::time_point program_start_ = clock::now();
  clock::time_point stage_start_ = program_start_;
  clock::time_point last_shown_ = program_start_;
};

}  // namespace app

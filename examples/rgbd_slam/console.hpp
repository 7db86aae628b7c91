// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the program says while it works: one line for each stage, with a progress bar while it lasts
/// if stderr is a terminal. Results go to stdout, everything else to stderr.
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

#include <orbis/core/execution.hpp>
#include <orbis/core/result.hpp>

namespace spdlog {
class logger;
}

namespace app {

class console {
 public:
  using clock = std::chrono::steady_clock;
  explicit console(bool quiet);

  /// Begins a stage; the one before is over.
  void stage(std::string_view name);
  /// Shows how far the stage is; `note` is free text. Costs next to nothing between redraws.
  void advance(std::size_t done, std::size_t total, const std::string& note = {});
  /// Ends the stage with what it gave.
  void finish(const std::string& outcome);
  /// Seconds since the stage began.
  [[nodiscard]] double elapsed() const;
  /// Seconds since the program began.
  [[nodiscard]] double total() const;

  /// A progress callback for a library call of this stage.
  [[nodiscard]] auto progress() {
    return [this](std::size_t done, std::size_t total) {
      advance(done, total);
      return true;
    };
  }

  void warn(const std::string& what);
  /// "rgbd_slam: where: message", in one line.
  void error(const orbis::error& e);
  /// Prints a line of the results on stdout, unless quiet; false if it could not be written.
  bool print(const std::string& line);
  [[nodiscard]] bool quiet() const { return quiet_; }

 private:
  void clear_bar();

  std::shared_ptr<spdlog::logger> log_;
  bool quiet_;
  bool terminal_;
  bool bar_shown_ = false;
  std::string stage_;
  clock::time_point program_start_ = clock::now();
  clock::time_point stage_start_ = program_start_;
  clock::time_point last_shown_ = program_start_;
};

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Timing of solver stages, and the default report.
#pragma once

#include <chrono>

namespace orbis::optimize::detail {

/// Adds the seconds between its construction and its destruction to `total`.
class stage_watch {
 public:
  explicit stage_watch(double& total) : total_{total}, start_{clock::now()} {}
  stage_watch(const stage_watch&) = delete;
  stage_watch& operator=(const stage_watch&) = delete;
  ~stage_watch() { total_ += std::chrono::duration<double>(clock::now() - start_).count(); }

 private:
  using clock = std::chrono::steady_clock;
  double& total_;
  clock::time_point start_;
};

/// Ignores all reports.
struct no_report {
  template <class Summary>
  void operator()(const Summary&) const noexcept {}
};

}  // namespace orbis::optimize::detail

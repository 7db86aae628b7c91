// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Measurement of the times in `track_timings`.
#pragma once

#include <chrono>

namespace orbis::slam::detail {

/// Measures the time between calls to `lap`.
class stopwatch {
 public:
  /// Sets `milliseconds` to the time since the last call, or since construction.
  void lap(double& milliseconds) {
    const auto now = std::chrono::steady_clock::now();
    milliseconds = std::chrono::duration<double, std::milli>(now - last_).count();
    last_ = now;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace orbis::slam::detail

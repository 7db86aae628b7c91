// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Estimates the time offset between depth images and colour images from their time stamps.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace orbis::camera {

/// Smooths the difference between the time stamps of a depth image and its colour image. Free-running sensors drift
/// slowly relative to each other; time stamps assigned by the host also vary by its polling interval.
class depth_clock {
 public:
  /// Adds the time stamps of a frame, seconds; returns the smoothed difference, depth minus colour. A difference below
  /// 0.5 ms is negligible and returned as zero. A jump of more than 8 ms is adopted immediately, because it means that
  /// colour images are now paired with depth images from another frame interval. If the depth image has no time stamp,
  /// or the two time stamps differ by more than 0.1 s, the difference is unchanged.
  [[nodiscard]] double update(double timestamp, std::optional<double> depth_timestamp) {
    constexpr double longest = 0.1, jump = 0.008, least = 0.0005;  // seconds
    constexpr double memory = 30.0;                                // frames
    const double difference = depth_timestamp.value_or(std::numeric_limits<double>::quiet_NaN()) - timestamp;
    if (std::abs(difference) <= longest) {
      if (!(std::abs(difference - smoothed_) <= jump)) count_ = 0.0;
      count_ = std::min(count_ + 1.0, memory);
      smoothed_ += (difference - smoothed_) / count_;
    }
    return std::abs(smoothed_) < least ? 0.0 : smoothed_;
  }

 private:
  double smoothed_ = 0.0, count_ = 0.0;
};

}  // namespace orbis::camera

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The times of depth images relative to those of colour images, by their time stamps.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace orbis::camera {

/// Smooths the difference of the time stamps of a depth image and its colour image. Sensors that run freely drift
/// slowly against each other; the stamps of a host vary in addition by the intervals at which it polls them.
class depth_clock {
 public:
  /// Adds the time stamps of a frame, seconds; returns the smoothed difference, depth minus colour. It is zero below
  /// 0.5 ms, which does not matter. A jump of more than 8 ms is taken over at once: colour images are paired with the
  /// depth images of another interval. Without a time stamp of the depth image, or if it differs by more than 0.1 s,
  /// the difference remains the same.
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

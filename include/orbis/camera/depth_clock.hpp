// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The times of depth images relative to those of colour images, by their time stamps.
#pragma once

#include <algorithm>
#include <cmath>

namespace orbis::camera {

/// Smooths the difference of the time stamps of a depth image and its colour image. Sensors that run freely drift
/// slowly against each other; the stamps of a host vary in addition by the intervals at which it polls them.
class depth_clock {
 public:
  /// Adds the difference of a frame, seconds; returns the smoothed one. A jump is taken over at once: colour images are
  /// paired with the depth images of the next interval. Smoothed differences that do not matter are zero.
  [[nodiscard]] double update(double difference) {
    constexpr double longest = 0.1, jump = 0.012, least = 0.0005;  // seconds
    constexpr double memory = 30.0;                                // frames
    if (!(std::abs(difference) <= longest)) return 0.0;
    if (!(std::abs(difference - smoothed_) <= jump)) count_ = 0.0;
    count_ = std::min(count_ + 1.0, memory);
    smoothed_ += (difference - smoothed_) / count_;
    return std::abs(smoothed_) < least ? 0.0 : smoothed_;
  }

 private:
  double smoothed_ = 0.0, count_ = 0.0;
};

}  // namespace orbis::camera

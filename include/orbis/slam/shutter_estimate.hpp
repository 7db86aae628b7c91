// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The estimate of a camera's shutter.
#pragma once

#include <limits>

#include <orbis/camera/shutter.hpp>

namespace orbis::slam {

/// A shutter estimated from frames; see `options::estimates_shutter`. For components that the motion does not
/// determine, `shutter` has the value assumed in tracking (0 by default), and the deviation is large or not finite.
/// Deviations include errors of the velocity and, until tracking assumes the value, half of its difference from the
/// assumed value.
struct shutter_estimate {
  camera::shutter shutter{};  ///< the estimate, with the same read-out for both images
  double read_out = 0.0;      ///< estimated read-out, not yet tested for significance, seconds
  double read_out_deviation = std::numeric_limits<double>::infinity();  ///< standard deviation, seconds
  double delay = 0.0;  ///< estimated delay of the depth image, not yet tested for significance, seconds
  double delay_deviation = std::numeric_limits<double>::infinity();  ///< standard deviation, seconds
  double observed = 0.0;                                             ///< total duration of the frames observed, seconds
};

}  // namespace orbis::slam

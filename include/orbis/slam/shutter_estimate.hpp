// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a recording tells of its camera's shutter.
#pragma once

#include <limits>

#include <orbis/camera/shutter.hpp>

namespace orbis::slam {

/// A shutter as the frames tell it; see `options::estimates_shutter`. What the motion cannot tell is 0 in `shutter`,
/// and has a deviation that is not small, or not finite.
struct shutter_estimate {
  camera::shutter shutter{};  ///< with the same read-out for both images
  double read_out = 0.0;      ///< the estimate of the read-out before its significance was judged, seconds
  double read_out_deviation = std::numeric_limits<double>::infinity();  ///< standard deviation, seconds
  double delay = 0.0;  ///< that of the depth image's delay before its significance was judged, seconds
  double delay_deviation = std::numeric_limits<double>::infinity();  ///< standard deviation, seconds
};

}  // namespace orbis::slam

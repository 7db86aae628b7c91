// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Smoothing of the depth of frames for the map.
#pragma once

#include <algorithm>
#include <cstdint>

#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/cloud/depth_smoothing.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>

#include "source.hpp"

namespace app {

/// Smooths depth images according to the noise of their sensor.
class frame_smoother {
 public:
  explicit frame_smoother(const frame_source& source) {
    const double focal = source.camera.model.k().fx;
    options_.steepest = steepest / focal;
    if (source.is_stereo() && source.camera.baseline)
      options_.noise = disparity_noise / (focal * *source.camera.baseline);
  }

  /// The frame with smoothed depth, in the unit of its depth image. Valid until the next call.
  [[nodiscard]] const orbis::camera::rgbd_frame& operator()(const orbis::camera::rgbd_frame& frame) {
    if (metres_.width() != frame.depth.width() || metres_.height() != frame.depth.height())
      metres_ = orbis::image<float>(frame.depth.width(), frame.depth.height());
    options_.resolution = 1.0 / frame.depth_scale;
    orbis::cloud::smooth_depth(orbis::seq, frame.depth_metres(), metres_.view(), options_, memory_);
    smooth_ = frame;
    constexpr float largest = 65534.0F;  // the largest stored value of a measurement
    const auto scale = static_cast<float>(frame.depth_scale);
    for (int y = 0; y != metres_.height(); ++y)
      for (int x = 0; x != metres_.width(); ++x)
        smooth_.depth(x, y) = static_cast<std::uint16_t>(std::min(metres_(x, y) * scale + 0.5F, largest));
    return smooth_;
  }

 private:
  static constexpr double steepest = 4.0;          // tangent of the steepest slant of a measured surface: 76 degrees
  static constexpr double disparity_noise = 0.25;  // standard deviation of stereo matching, pixels
  orbis::cloud::depth_smoothing_options options_;
  orbis::image<float> metres_, memory_;
  orbis::camera::rgbd_frame smooth_;
};

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Smoothing of the depth of frames for the map.
#pragma once

#include <algorithm>
#include <cstdint>

#include <orbis/camera/any.hpp>
#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/cloud/depth_smoothing.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/types.hpp>

namespace app {

class frame_smoother {
 public:
  explicit frame_smoother(const orbis::camera::any_camera& camera) {
    const orbis::vec2 middle{0.5 * camera.width(), 0.5 * camera.height()};
    const auto ray = camera.unproject(middle), next = camera.unproject(middle + orbis::vec2::UnitX());
    if (ray && next) options_.steepest = steepest * (*next - *ray).norm();
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
  static constexpr double steepest = 4.0;  // tangent of the steepest slant of a surface that is measured: 76 degrees
  orbis::cloud::depth_smoothing_options options_;
  orbis::image<float> metres_, memory_;
  orbis::camera::rgbd_frame smooth_;
};

}  // namespace app

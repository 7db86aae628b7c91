// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Smoothing of the depth of frames for the map.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include <orbis/camera/any.hpp>
#include <orbis/camera/depth.hpp>
#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/cloud/depth_smoothing.hpp>
#include <orbis/cloud/flying_pixels.hpp>
#include <orbis/cloud/smeared_edges.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/slam/measure.hpp>

#include "source.hpp"

namespace app {

/// Smooths depth images according to the noise of their sensor, and removes pixels that show no surface.
class frame_smoother {
 public:
  explicit frame_smoother(const frame_source& source) : camera_{source.camera.model} {
    const double focal = source.camera.model.k().fx;
    options_.steepest = steepest / focal;
    if (!source.is_stereo()) return;
    exposure_ = 0.0;  // stereo matching finds edges at their places in both images: they do not become ramps
    if (source.camera.baseline) options_.noise = flying_.noise = disparity_noise / (focal * *source.camera.baseline);
  }

  /// The frame with smoothed depth, in the unit of its depth image. Flying pixels are removed, and the depth that the
  /// camera's motion `m` smears over edges (zero if it is unknown). Valid until the next call.
  [[nodiscard]] const orbis::camera::rgbd_frame& operator()(const orbis::camera::rgbd_frame& frame,
                                                            const orbis::slam::frame_motion& m) {
    if (metres_.width() != frame.depth.width() || metres_.height() != frame.depth.height())
      metres_ = orbis::image<float>(frame.depth.width(), frame.depth.height());
    options_.resolution = smeared_.resolution = 1.0 / frame.depth_scale;
    orbis::cloud::remove_smeared_edges(orbis::seq, frame.depth_metres(), camera_, m.twist, exposure_, metres_.view(),
                                       smeared_, smeared_workspace_);
    const orbis::camera::depth_view<float> metres{std::as_const(metres_).view()};
    orbis::cloud::remove_flying_pixels(orbis::seq, metres, metres_.view(), flying_, workspace_);
    orbis::cloud::smooth_depth(orbis::seq, metres, metres_.view(), options_, memory_);
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
  orbis::camera::any_camera camera_;
  double exposure_ = 0.016;  // of a depth image, seconds: half the frame interval at 30 Hz
  orbis::cloud::smeared_edge_options smeared_;
  orbis::cloud::smeared_edge_workspace smeared_workspace_;
  orbis::cloud::flying_pixel_options flying_;
  orbis::cloud::flying_pixel_workspace workspace_;
  orbis::cloud::depth_smoothing_options options_;
  orbis::image<float> metres_, memory_;
  orbis::camera::rgbd_frame smooth_;
};

}  // namespace app

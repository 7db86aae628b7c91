// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Smoothing of the depth of frames for the map.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include <orbis/camera/any.hpp>
#include <orbis/camera/depth.hpp>
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
  explicit frame_smoother(const frame_source& source)
      : camera_{source.camera.model}, depth_scale_{source.camera.depth_scale} {
    const double focal = source.camera.model.k().fx;
    options_.steepest = steepest / focal;
    options_.resolution = smeared_.resolution = 1.0 / depth_scale_;
    if (!source.is_stereo()) return;
    exposure_ = 0.0;  // stereo matching finds edges at their places in both images: they do not become ramps
    if (source.camera.baseline) options_.noise = flying_.noise = disparity_noise / (focal * *source.camera.baseline);
  }

  /// The smoothed depth image, in the unit of `depth`. Flying pixels are removed, and the depth that the camera's
  /// motion `m` smears over edges (zero if it is unknown). Valid until the next call.
  [[nodiscard]] const orbis::image<std::uint16_t>& operator()(const orbis::image<std::uint16_t>& depth,
                                                              const orbis::slam::frame_motion& m) {
    if (metres_.width() != depth.width() || metres_.height() != depth.height()) {
      metres_ = orbis::image<float>(depth.width(), depth.height());
      smooth_ = orbis::image<std::uint16_t>(depth.width(), depth.height());
    }
    orbis::cloud::remove_smeared_edges(orbis::seq, orbis::camera::depth_view{depth, depth_scale_}, camera_, m.twist,
                                       exposure_, metres_.view(), smeared_, smeared_workspace_);
    const orbis::camera::depth_view<float> metres{std::as_const(metres_).view()};
    orbis::cloud::remove_flying_pixels(orbis::seq, metres, metres_.view(), flying_, workspace_);
    orbis::cloud::smooth_depth(orbis::seq, metres, metres_.view(), options_, memory_);
    constexpr float largest = 65534.0F;  // the largest stored value of a measurement
    const auto scale = static_cast<float>(depth_scale_);
    std::ranges::transform(std::as_const(metres_).pixels(), smooth_.pixels().begin(),
                           [&](float z) { return static_cast<std::uint16_t>(std::min(z * scale + 0.5F, largest)); });
    return smooth_;
  }

 private:
  static constexpr double steepest = 4.0;          // tangent of the steepest slant of a measured surface: 76 degrees
  static constexpr double disparity_noise = 0.25;  // standard deviation of stereo matching, pixels
  orbis::camera::any_camera camera_;
  double depth_scale_;
  double exposure_ = 0.016;  // of a depth image, seconds: half the frame interval at 30 Hz
  orbis::cloud::smeared_edge_options smeared_;
  orbis::cloud::smeared_edge_workspace smeared_workspace_;
  orbis::cloud::flying_pixel_options flying_;
  orbis::cloud::flying_pixel_workspace workspace_;
  orbis::cloud::depth_smoothing_options options_;
  orbis::image<float> metres_, memory_;
  orbis::image<std::uint16_t> smooth_;
};

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Rolling-shutter correction of frames for the map.
#pragma once

#include <cstdint>
#include <utility>

#include <orbis/camera/any.hpp>
#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/camera/shutter_correction.hpp>
#include <orbis/core/types.hpp>
#include <orbis/slam/measure.hpp>

namespace app {

/// Distance in pixels between the rows and columns whose pixels become points.
inline constexpr int point_stride = 2;

class frame_correction {
 public:
  explicit frame_correction(orbis::camera::any_camera camera) : correct_{std::move(camera)} {}

  /// The frame as a global shutter would have captured it; the frame itself if no correction is needed or the camera
  /// moved too fast. Only rows whose pixels become points have valid colours. `m`: the shutter of the frame, and the
  /// motion during the read-out. Valid until the next call.
  [[nodiscard]] const orbis::camera::rgbd_frame& operator()(const orbis::camera::rgbd_frame& frame,
                                                            const orbis::slam::frame_motion& m) {
    if (!correct_.is_needed(m.shutter, m.twist)) return frame;
    if (corrected_.depth.width() != frame.depth.width() || corrected_.depth.height() != frame.depth.height()) {
      corrected_.depth = orbis::image<std::uint16_t>(frame.depth.width(), frame.depth.height());
      corrected_.color = orbis::image<orbis::rgb8>(frame.depth.width(), frame.depth.height());
    }
    corrected_.timestamp = frame.timestamp;
    corrected_.depth_scale = frame.depth_scale;
    corrected_.T_world_camera = frame.T_world_camera;
    const bool done = correct_.depth(m.shutter, m.twist, frame.depth_metres(), corrected_.depth.view()) &&
                      correct_.color(m.shutter, m.twist, corrected_.depth_metres(), frame.color.view(),
                                     corrected_.color.view(), point_stride);
    return done ? corrected_ : frame;
  }

  /// Corrects the colours of the rows that become points; other rows become black. The depth is already corrected.
  void correct_color(const orbis::camera::depth_view<std::uint16_t>& corrected, const orbis::slam::frame_motion& m,
                     orbis::image<orbis::rgb8>& color) {
    if (!correct_.is_needed(m.shutter, m.twist)) return;
    orbis::image<orbis::rgb8> out(color.width(), color.height());
    if (correct_.color(m.shutter, m.twist, corrected, color.view(), out.view(), point_stride)) color = std::move(out);
  }

 private:
  orbis::camera::shutter_correction<orbis::camera::any_camera> correct_;
  orbis::camera::rgbd_frame corrected_;
};

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Removal of moving objects from depth images for the map.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/core/image.hpp>
#include <orbis/mapping/moving_regions.hpp>
#include <orbis/slam/track_result.hpp>

namespace app {

class static_frames {
 public:
  explicit static_frames(const orbis::camera::any_camera& camera) : regions_{camera} {}

  /// The depth image of a frame without surfaces with moving features; the frame's own image if there are none.
  /// `tracked`: the frame's features in SLAM. Valid until the next call.
  [[nodiscard]] const orbis::image<std::uint16_t>& operator()(
      const orbis::camera::rgbd_frame& frame, const std::optional<orbis::slam::tracked_frame>& tracked) {
    if (!tracked) return frame.depth;
    marks_.clear();
    for (const orbis::slam::tracked_feature& f : tracked->features)
      if (f.moving || f.tracked) marks_.push_back({f.x, f.y, f.moving});
    if (!regions_.find(frame.depth_metres(), marks_)) return frame.depth;
    standing_ = frame.depth;
    regions_.remove(frame.depth_metres(), standing_.view());
    return standing_;
  }

 private:
  orbis::mapping::moving_regions<orbis::camera::any_camera> regions_;
  std::vector<orbis::mapping::marked_pixel> marks_;
  orbis::image<std::uint16_t> standing_;
};

}  // namespace app

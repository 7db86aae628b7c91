// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Correction of rolling-shutter keypoints to their positions at the time of the frame.
///
/// The camera moves with a constant body twist while an image is read out. A keypoint in a row read `t` seconds after
/// the frame's time observes a point at `p` in the camera frame at that moment; in the camera frame at the frame's
/// time, the point is at `exp(t * twist) p`. Its projection and depth there are equivalent to a measurement with a
/// global shutter, so that later steps do not depend on row times.
///
/// Source of the constant-velocity model during read-out: J. Hedborg, P.-E. Forssen, M. Felsberg, E. Ringaby, "Rolling
/// shutter bundle adjustment", CVPR 2012.
#pragma once

#include <cmath>
#include <cstddef>
#include <optional>

#include <orbis/camera/model.hpp>
#include <orbis/camera/shutter.hpp>
#include <orbis/core/types.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/frame.hpp>

namespace orbis::slam::detail {

using camera::moved_by;

/// Copies the keypoints to `as_read`. @pre their rays and depths are set
template <feature_descriptor D>
void keep_as_read(basic_frame<D>& f) {
  f.as_read.resize(f.size());
  for (std::size_t i = 0; i != f.size(); ++i)
    f.as_read[i] = {
        f.rays[i].x(), f.rays[i].y(), f.features.keypoints[i].x, f.features.keypoints[i].y, f.depth[i], f.depth[i], {}};
}

/// Moves the keypoints from their positions as read to those at the frame's time; sets their rays and depths, the grid
/// and `f.twist`. `depth_of(i)` returns the depth of the point that keypoint `i`, without measured depth, observes; 0
/// if it is unknown: the point is then treated as distant, so that only the rotation is applied. A keypoint that would
/// leave the image keeps its position as read. Does nothing if `as_read` is empty (`keep_as_read`). O(features).
template <feature_descriptor D, camera::camera_model Camera, class DepthOf>
void move_to_frame_time(basic_frame<D>& f, const camera_rig<Camera>& rig, const camera::shutter& shutter,
                        const vec6& twist, DepthOf&& depth_of) {
  if (f.as_read.empty()) return;
  f.twist = twist;
  const int height = rig.camera().height();
  for (std::size_t i = 0; i != f.as_read.size(); ++i) {
    const keypoint_as_read& read = f.as_read[i];
    auto& at = f.features.keypoints[i];
    const double t = shutter.color_time(static_cast<double>(read.y), height);
    const double known = read.depth > 0.0F ? static_cast<double>(read.depth) : depth_of(i);
    constexpr double far = 1e6;  // metres
    const vec3 moved = moved_by(twist, t, (known > 0.0 ? known : far) * vec3(read.ray_x, read.ray_y, 1.0));
    const auto pixel = moved.z() > 0.0 ? rig.camera().project(moved) : std::nullopt;
    if (!pixel) {  // also true if it has no ray
      at.x = read.x, at.y = read.y;
      f.rays[i] = {read.ray_x, read.ray_y, std::isnan(read.ray_x) ? read.ray_x : 1.0};
      f.depth[i] = read.depth;
      continue;
    }
    at.x = static_cast<float>(pixel->x()), at.y = static_cast<float>(pixel->y());
    f.rays[i] = {moved.x() / moved.z(), moved.y() / moved.z(), 1.0};
    f.depth[i] = read.depth > 0.0F ? static_cast<float>(moved.z()) : 0.0F;
  }
  f.grid.assign(f.features.keypoints);
}

/// As above, but all keypoints without measured depth are treated as distant.
template <feature_descriptor D, camera::camera_model Camera>
void move_to_frame_time(basic_frame<D>& f, const camera_rig<Camera>& rig, const camera::shutter& shutter,
                        const vec6& twist) {
  move_to_frame_time(f, rig, shutter, twist, [](std::size_t) { return 0.0; });
}

}  // namespace orbis::slam::detail

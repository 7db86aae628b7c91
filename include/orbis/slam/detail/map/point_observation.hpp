// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The observation of a point by a keypoint, and a test for their agreement.
#pragma once

#include <algorithm>
#include <cstddef>

#include <orbis/camera/model.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/robust_loss.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/frame.hpp>

namespace orbis::slam::detail {

/// Returns keypoint `i` of a frame as an observation of `point` (world, metres); the standard deviation of the keypoint
/// is one pixel of its level.
template <camera::camera_model Camera, feature_descriptor D>
[[nodiscard]] optimize::pose_observation make_observation(const camera_rig<Camera>& rig, const basic_frame<D>& f,
                                                          std::size_t i, const vec3& point) {
  optimize::pose_observation o;
  o.point = point;
  o.pixel = f.pixel(i);
  if (f.has_depth(i)) o.right = rig.model.right(o.pixel.x(), static_cast<double>(f.depth[i]));
  o.information = rig.scales.information(f.features.keypoints[i].octave);
  return o;
}

/// Sets the weights of an observation of the keypoint's own landmark. `spread`: `basic_frame::spread`. Up to a
/// deviation of 1, the standard deviation of the depth is unchanged, but the third residual also depends on that of the
/// pixel.
inline void set_spread(optimize::pose_observation& o, const pixel_spread& spread) {
  const double deviation = static_cast<double>(spread.deviation);
  o.information /= deviation * deviation;
  o.depth_weight = std::min(1.0, deviation);
  o.smear = spread.smear() / deviation;
}

/// Returns the observation of the landmark of keypoint `i`, at `position` (world, metres).
template <camera::camera_model Camera, feature_descriptor D>
[[nodiscard]] optimize::pose_observation landmark_observation(const camera_rig<Camera>& rig, const basic_frame<D>& f,
                                                              std::size_t i, const vec3& position) {
  optimize::pose_observation o = make_observation(rig, f, i, position);
  set_spread(o, f.spread(i));
  return o;
}

/// The 95 % chi-square limit of a squared error, divided by its variance, for two coordinates, or for three with depth.
[[nodiscard]] constexpr double error_limit(bool has_depth) noexcept {
  return optimize::chi_squared_gate(has_depth ? 3 : 2);
}

/// Returns true if keypoint `i` of a frame agrees with `point` (world, metres): the squared reprojection error, divided
/// by its variance, is at most `error_limit`. The standard deviation of the keypoint is one pixel of its level, and
/// larger along its smear.
template <camera::camera_model Camera, feature_descriptor D>
[[nodiscard]] bool agrees(const camera_rig<Camera>& rig, const basic_frame<D>& f, const se3& T_camera_world,
                          std::size_t i, const vec3& point) {
  optimize::pose_observation o = make_observation(rig, f, i, point);
  o.smear = f.spread(i).smear();
  const auto error = rig.model.residual(T_camera_world * point, o);
  return error && squared_norm(*error) * o.information <= error_limit(o.has_depth());
}

}  // namespace orbis::slam::detail

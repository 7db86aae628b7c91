// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Frames and keyframes: the features of an image, their depth, and the landmarks they observe.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include <orbis/camera/shutter.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/grid.hpp>
#include <orbis/slam/extractor.hpp>
#include <orbis/slam/ids.hpp>

namespace orbis::slam {

/// The kind of sensor that captured a frame.
enum class sensor_kind : std::uint8_t { unknown, rgbd, stereo, monocular };

[[nodiscard]] constexpr std::string_view to_string(sensor_kind kind) noexcept {
  switch (kind) {
    case sensor_kind::unknown: return "unknown";
    case sensor_kind::rgbd: return "rgbd";
    case sensor_kind::stereo: return "stereo";
    case sensor_kind::monocular: return "monocular";
  }
  return "unknown";
}

/// Change in the depth of a keypoint if the depth image had been captured `step` seconds later or earlier than assumed,
/// in metres; 0 if unknown.
struct depth_change {
  static constexpr double step = 0.008;  ///< seconds; short enough that few depth edges are crossed
  float later = 0.0F, earlier = 0.0F;
  /// Returns this change if the depth varies smoothly, as on a surface; otherwise zero: a depth edge between the
  /// readings would be mistaken for motion.
  [[nodiscard]] depth_change if_even(float depth) const noexcept {
    constexpr float limit = 0.02F;  // 1 / metres: a few standard deviations of a depth camera's noise
    return std::abs(later + earlier) <= limit * depth * depth ? *this : depth_change{};
  }
  /// Returns the rate of change, metres per second.
  [[nodiscard]] double rate() const noexcept {
    return (static_cast<double>(later) - static_cast<double>(earlier)) / (2.0 * step);
  }
};

/// A keypoint as read by a rolling shutter, at the time of its row.
struct keypoint_as_read {
  double ray_x = 0.0, ray_y = 0.0;  ///< ray through the keypoint, scaled to z = 1; NaN if the pixel has none
  float x = 0.0F, y = 0.0F;         ///< pixels
  float depth = 0.0F;               ///< depth at the time of the row, metres; 0 if unknown
  float stored_depth = 0.0F;        ///< value of the depth image at the keypoint, metres; 0 if not measured
  depth_change change{};            ///< change of `depth`; set only for the estimation of the shutter
};

/// Uncertainty of a keypoint's position, in pixels of its pyramid level: the covariance is `deviation^2 I + s s^T`,
/// where s = (smear_x, smear_y).
struct pixel_spread {
  float deviation = 1.0F;                ///< standard deviation in all directions, > 0
  float smear_x = 0.0F, smear_y = 0.0F;  ///< direction of the motion blur times the standard deviation along it

  /// (smear_x, smear_y), pixels of the level.
  [[nodiscard]] vec2 smear() const noexcept { return {static_cast<double>(smear_x), static_cast<double>(smear_y)}; }
};

/// An image represented by features with descriptors of type `D`. Each vector has one entry per keypoint; some vectors
/// may be empty.
template <feature_descriptor D>
struct basic_frame {
  using descriptor_type = D;

  double timestamp = 0.0;  ///< seconds
  std::size_t index = 0;   ///< index in the recording, from 0
  se3 T_world_camera;      ///< pose in the world frame of its map
  orbis::features::basic_features<D> features;
  std::vector<float> depth;                   ///< metres along z; 0 if not measured
  std::vector<pixel_spread> spreads;          ///< of each keypoint; empty: all are the default. Not stored in map files
  std::vector<vec3> rays;                     ///< ray through each keypoint, scaled to z = 1; NaN if the pixel has none
  std::vector<landmark_id> landmarks;         ///< landmark observed by each keypoint, or `no_id`
  orbis::features::keypoint_grid grid;        ///< search grid of the keypoints
  sensor_kind sensor = sensor_kind::unknown;  ///< custom sensors may leave it `unknown`
  bool scale_is_known = true;                 ///< false if no lengths are measured; set by the system
  /// True if the pose is constrained by depth, with few or no landmarks. Adjustments, which use only landmarks, keep
  /// the pose fixed. Not stored in map files.
  bool held_by_depth = false;
  /// The keypoints as read by a rolling shutter; the other members refer to the frame's time. Empty with a global
  /// shutter.
  std::vector<keypoint_as_read> as_read;
  camera::shutter shutter{};   ///< the shutter assumed for the frame, including its depth image delay
  vec6 twist = zeros<vec6>();  ///< twist of the camera in its own frame during read-out, per second, translation first

  /// The number of features.
  [[nodiscard]] std::size_t size() const noexcept { return features.size(); }
  [[nodiscard]] bool has_depth(std::size_t i) const noexcept { return depth[i] > 0.0F; }
  /// The point at the depth of keypoint `i`, in the camera frame, metres. @pre has_depth(i)
  [[nodiscard]] vec3 point_camera(std::size_t i) const { return static_cast<double>(depth[i]) * rays[i]; }
  /// Like `point_camera`, in the world frame. @pre has_depth(i)
  [[nodiscard]] vec3 point_world(std::size_t i) const { return T_world_camera * point_camera(i); }
  /// Returns the uncertainty of the position of keypoint `i`.
  [[nodiscard]] pixel_spread spread(std::size_t i) const { return spreads.empty() ? pixel_spread{} : spreads[i]; }
  [[nodiscard]] vec2 pixel(std::size_t i) const { return {features.keypoints[i].x, features.keypoints[i].y}; }
};

/// A frame stored in the map. Its `landmarks` are one side of the map's observations.
template <feature_descriptor D>
struct basic_keyframe : basic_frame<D> {
  keyframe_id id;
  /// Factor by which corrections have scaled the lengths around the keyframe since its creation, in maps whose scale is
  /// not measured. Multiply data stored relative to the keyframe by the change of this factor.
  double scale = 1.0;
};

/// Frames and keyframes with ORB descriptors.
using frame = basic_frame<features::binary_descriptor<256>>;
using keyframe = basic_keyframe<features::binary_descriptor<256>>;

}  // namespace orbis::slam

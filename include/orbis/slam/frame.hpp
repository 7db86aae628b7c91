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

/// The sensor that took a frame.
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

/// Change of the depth of a keypoint if the depth image were `step` seconds later, and earlier, than assumed, metres; 0
/// if unknown.
struct depth_change {
  static constexpr double step = 0.008;  ///< seconds: short enough that few edges are in between
  float later = 0.0F, earlier = 0.0F;
  /// Returns this change if depth changes evenly there, as on a surface; otherwise zero: an edge between the readings
  /// would be mistaken for a motion.
  [[nodiscard]] depth_change if_even(float depth) const noexcept {
    constexpr float limit = 0.02F;  // 1 / metres: a few standard deviations of a depth camera's noise
    return std::abs(later + earlier) <= limit * depth * depth ? *this : depth_change{};
  }
  /// Metres per second.
  [[nodiscard]] double rate() const noexcept {
    return (static_cast<double>(later) - static_cast<double>(earlier)) / (2.0 * step);
  }
};

/// A keypoint as read by a rolling shutter, at the time of its row.
struct keypoint_as_read {
  double ray_x = 0.0, ray_y = 0.0;  ///< ray through it, scaled to z = 1; NaN if the pixel has none
  float x = 0.0F, y = 0.0F;         ///< pixels
  float depth = 0.0F;               ///< at the time of the row, metres; 0 if unknown
  float stored_depth = 0.0F;        ///< depth image at the keypoint, metres; 0 if not measured
  depth_change change{};            ///< of `depth`; zero unless the shutter is estimated
};

/// An image as features of descriptor type `D`. All vectors have one entry per keypoint, except those that
/// may be empty.
template <feature_descriptor D>
struct basic_frame {
  using descriptor_type = D;

  double timestamp = 0.0;  ///< seconds
  std::size_t index = 0;   ///< index in the recording, from 0
  se3 T_world_camera;      ///< in the world of the frame's map
  orbis::features::basic_features<D> features;
  std::vector<float> depth;  ///< metres along z; 0 if not measured
  /// Standard deviation of the position of each keypoint, pixels of its pyramid level; empty: 1. Not stored in map
  /// files.
  std::vector<float> deviations;
  std::vector<vec3> rays;                     ///< through each keypoint, scaled to z = 1; NaN if the pixel has no ray
  std::vector<landmark_id> landmarks;         ///< observed by each keypoint, or `no_id`
  orbis::features::keypoint_grid grid;        ///< of the keypoints
  sensor_kind sensor = sensor_kind::unknown;  ///< custom sensors may leave it `unknown`
  bool scale_is_known = true;                 ///< false if no lengths are measured; set by the system
  /// True if the pose is constrained by depth, with few or no landmarks. Adjustments, which use only landmarks, keep
  /// the pose fixed. Not stored in map files.
  bool held_by_depth = false;
  /// The keypoints as read with a rolling shutter; the other members are for the frame's time. Empty with a global
  /// shutter.
  std::vector<keypoint_as_read> as_read;
  camera::shutter shutter{};   ///< assumed for the frame; its depth image delay is that of this frame
  vec6 twist = zeros<vec6>();  ///< motion of the camera in its own frame during read-out, per second, translation first

  /// The number of features.
  [[nodiscard]] std::size_t size() const noexcept { return features.size(); }
  [[nodiscard]] bool has_depth(std::size_t i) const noexcept { return depth[i] > 0.0F; }
  /// The point that keypoint `i` observes by its depth, in the camera frame, metres. @pre has_depth(i)
  [[nodiscard]] vec3 point_camera(std::size_t i) const { return static_cast<double>(depth[i]) * rays[i]; }
  /// Like `point_camera`, in the world frame. @pre has_depth(i)
  [[nodiscard]] vec3 point_world(std::size_t i) const { return T_world_camera * point_camera(i); }
  /// Returns the deviation of keypoint `i`, pixels of its pyramid level.
  [[nodiscard]] double deviation(std::size_t i) const {
    return deviations.empty() ? 1.0 : static_cast<double>(deviations[i]);
  }
  [[nodiscard]] vec2 pixel(std::size_t i) const { return {features.keypoints[i].x, features.keypoints[i].y}; }
};

/// A frame stored in the map. Its `landmarks` are one side of the map's observations.
template <feature_descriptor D>
struct basic_keyframe : basic_frame<D> {
  keyframe_id id;
  /// Factor by which corrections have scaled the lengths around the keyframe since it was made, in maps whose scale is
  /// not measured. Multiply data stored relative to the keyframe by the change of this factor.
  double scale = 1.0;
};

/// Frames and keyframes with ORB descriptors.
using frame = basic_frame<features::binary_descriptor<256>>;
using keyframe = basic_keyframe<features::binary_descriptor<256>>;

}  // namespace orbis::slam

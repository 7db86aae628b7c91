// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What can be set about the SLAM system.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include <orbis/core/se3.hpp>
#include <orbis/features/orb.hpp>

namespace orbis::slam {

/// When a frame becomes a keyframe.
struct keyframe_options {
  double interval = 0.3;             ///< seconds since the last one, after which having moved is reason enough
  double moved = 0.06;               ///< metres since the last one that count as having moved ...
  double turned = 0.06;              ///< ... or radians
  double inlier_ratio = 0.75;        ///< of the landmarks that the reference keyframe has: below it, a new one
  double inlier_ratio_start = 0.4;   ///< the same while there is one keyframe only
  std::size_t min_inliers = 15;      ///< with fewer the pose is not trusted enough
  std::size_t close_tracked = 100;   ///< fewer tracked close points than this ...
  std::size_t close_untracked = 70;  ///< ... and more untracked ones than this: a new one
};

/// Local bundle adjustment after each keyframe.
struct adjustment_options {
  std::size_t keyframes = 12;   ///< that may move: the newest and those that share most with it; 0: no adjustment
  std::size_t min_shared = 15;  ///< landmarks, to be a neighbour
  int robust_iterations = 5;    ///< before outliers are taken out
  int iterations = 5;           ///< after that
};

/// What the map drops again.
struct culling_options {
  double found_ratio = 0.25;            ///< of the frames that should show a landmark: it stays if found in so many ...
  std::uint32_t min_visible = 8;        ///< ... or while fewer frames than this should have shown it
  std::uint32_t age = 2;                ///< keyframes after its own, when a landmark must have ...
  std::uint32_t min_support = 4;        ///< ... observations, those with depth counted twice
  std::size_t neighborhood = 20;        ///< keyframes around the newest one in which is looked for what can go
  double redundant = 0.9;               ///< a keyframe goes when this part of its close landmarks is seen ...
  std::size_t redundant_observers = 3;  ///< ... by so many others ...
  int coarser_levels = 1;               ///< ... at most that many levels coarser
};

struct options {
  /// Of the default extractor. `levels` and `scale_factor` must be those of any other extractor.
  features::orb_options features{};
  /// Focal length times the baseline of the virtual stereo camera whose disparity the depth stands
  /// for, pixel metres: a depth z counts as measured to `z^2 / bf` metres (times the scale of the
  /// keypoint's level). 400 is close to the noise of a Kinect.
  double bf = 400.0;
  double min_depth = 0.1;               ///< metres; measurements outside are not used
  double max_depth = 10.0;              ///< metres
  double close_depth = 3.2;             ///< metres; points nearer than this become landmarks at once
  std::size_t min_new_landmarks = 100;  ///< that many become landmarks even if they are not close
  std::size_t min_start_points = 100;   ///< keypoints with depth it takes to start
  std::size_t min_inliers = 20;         ///< of a tracked frame
  std::size_t min_relocalized = 40;     ///< inliers of a relocalised frame
  double motion_radius = 15.0;          ///< of the search around a prediction by motion, pixels of a keypoint's level
  double search_radius = 4.0;           ///< of the search for landmarks around a refined pose, likewise
  std::size_t local_keyframes = 40;     ///< whose landmarks are searched for in a frame
  std::size_t relocalization_candidates = 8;  ///< keyframes that pose estimation is tried against, at most
  keyframe_options keyframes{};
  adjustment_options adjustment{};
  culling_options culling{};
  std::optional<se3> initial_pose{};  ///< `T_world_camera` of the first frame; default: the identity
  std::uint64_t seed = 1;             ///< of RANSAC
};

}  // namespace orbis::slam

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What can be set about the SLAM system.
#pragma once

#include <cstddef>
#include <cstdint>
#include <numbers>
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

/// What is done when tracking is lost.
struct recovery_options {
  std::size_t candidates = 8;         ///< keyframes that pose estimation is tried against, at most
  std::size_t min_inliers = 40;       ///< of a relocalised frame
  double new_map_after = 1.0;         ///< seconds without a pose, after which a new map is begun
  std::size_t min_map_keyframes = 3;  ///< a map with fewer is dropped then, and the frames that were tracked in it
};

struct triangulation_options {
  std::size_t neighbors = 10;    ///< keyframes around the new one that are searched
  double min_baseline = 0.03;    ///< metres between two keyframes; nearer ones show too little parallax
  double min_parallax = 0.05;    ///< radians between two rays that make a point: one in 20 of the distance
  std::uint32_t distance = 50;   ///< bits by which descriptors may differ
  float ratio = 0.6F;            ///< of that to the second best along the line
  float line_distance = 1.96F;   ///< from the epipolar line, pixels of a keypoint's level
  float epipole_radius = 10.0F;  ///< around the epipole nothing is matched, likewise
  double scale_tolerance = 1.5;  ///< by this, and one level, the ratio of levels may differ from that of distances
};

/// What makes a loop.
struct loop_options {
  std::uint32_t distance = 64;           ///< bits by which descriptors of the two keyframes may differ, ...
  float ratio = 0.85F;                   ///< ... and of the distance to the second best match
  std::size_t min_matches = 20;          ///< by bow_vector, between the two keyframes
  double alignment_threshold = 3.0;      ///< of an inlier among these, standard deviations of the depth
  std::size_t min_aligned = 12;          ///< inliers among these
  std::size_t neighbors = 10;            ///< of the candidate, whose landmarks are looked for as well
  double wide_radius = 12.0;             ///< of the search for landmarks around the first estimate of the pose, pixels
  double radius = 4.0;                   ///< ... and around the refined one
  std::uint32_t landmark_distance = 50;  ///< bits by which the descriptors of landmarks may differ
  std::size_t min_inliers = 40;          ///< landmarks of the candidate's neighbourhood that the keyframe must show
  std::size_t supporters = 5;            ///< neighbours of the keyframe that are asked, ...
  std::size_t min_supporters = 2;        ///< ... of which so many (or all, if there are fewer) must agree, ...
  std::size_t supporter_inliers = 20;    ///< ... each of which must show so many of the landmarks
  double max_translation = 0.1;          ///< drift that is always believed, metres, ...
  double translation_per_metre = 0.05;   ///< ... and per metre of the way between the two keyframes
  double max_rotation = 5.0 * std::numbers::pi / 180.0;        ///< the same of the rotation, radians
  double rotation_per_metre = 1.0 * std::numbers::pi / 180.0;  ///< ... per metre
  std::uint64_t seed = 1;                                      ///< of RANSAC
};

/// How the two sides of a loop are sewn together.
struct loop_fusion_options {
  std::size_t keyframes = 15;   ///< around the keyframe, in which the candidate's landmarks are looked for
  std::size_t neighbors = 15;   ///< of the candidate, whose landmarks these are
  double radius = 4.0;          ///< of the search around a projection, pixels of a keypoint's level
  std::uint32_t distance = 50;  ///< bits by which descriptors may differ
};

struct loop_correction_options {
  std::uint32_t strong = 100;  ///< landmarks that both see, from which on a pair is an edge of the essential graph
  double loop_weight = 100.0;  ///< of the new edge, relative to that of a pair that shares `strong` landmarks
  int iterations = 20;         ///< of the pose graph, at most
  loop_fusion_options fusion{};
};

struct global_adjustment_options {
  int robust_iterations = 10;         ///< before outliers are taken out, at most
  int iterations = 20;                ///< after that, at most
  double relative_tolerance = 1e-6;   ///< either ends when a step lowers the cost by less than this share
  std::size_t min_observations = 10;  ///< of a keyframe; one with fewer goes with its parent in the tree
};

/// How places are recognised, and what is done then.
struct place_options {
  bool enabled = true;           ///< off: no loops are closed, and no maps merged; relocalisation works all the same
  std::size_t candidates = 5;    ///< that a new keyframe is compared with, at most
  std::uint32_t apart = 10;      ///< keyframes that lie between the two sides of a loop, and between two loops
  bool adjusts_globally = true;  ///< the whole map, after each loop and merger
  loop_options loop{};
  loop_correction_options correction{};
  global_adjustment_options adjustment{};
};

/// Who does the mapping.
struct thread_options {
  /// Off: `track` does everything, and the same frames give the same bytes. On: mapping, loop closing and global
  /// adjustment have a thread each, and `track` returns as soon as the pose is known.
  bool enabled = false;
  std::size_t max_waiting = 3;  ///< keyframes that may wait, 1 at least; with so many no further one is made, ...
  bool wait = false;            ///< ... or `track` waits: for recordings, which must not outrun the mapping
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
  double motion_radius = 15.0;          ///< of the search around a prediction by motion, pixels of a keypoint's level
  double search_radius = 4.0;           ///< of the search for landmarks around a refined pose, likewise
  std::size_t local_keyframes = 40;     ///< whose landmarks are searched for in a frame
  keyframe_options keyframes{};
  adjustment_options adjustment{};
  culling_options culling{};
  recovery_options recovery{};
  place_options places{};
  triangulation_options triangulation{};
  thread_options threads{};
  /// No keyframes are made, and the map stays as it is: for a map that was loaded.
  bool localization_only = false;
  std::optional<se3> initial_pose{};  ///< `T_world_camera` of the first frame; default: the identity
  std::uint64_t seed = 1;             ///< of RANSAC
};

}  // namespace orbis::slam

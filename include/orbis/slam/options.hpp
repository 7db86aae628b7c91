// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The options of the SLAM system.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>

#include <orbis/camera/shutter.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/features/orb.hpp>

namespace orbis::slam {

/// Conditions for a frame to become a keyframe.
struct keyframe_options {
  double interval = 0.3;  ///< seconds since the last keyframe, after which motion is a sufficient reason
  /// Metres (without depth, median depths of the view) since the last keyframe that count as motion ...
  double moved = 0.06;
  double turned = 0.06;              ///< ... or radians
  double inlier_ratio = 0.75;        ///< a keyframe is made below this fraction of the reference keyframe's landmarks
  double inlier_ratio_start = 0.4;   ///< `inlier_ratio` while the map has one keyframe
  std::size_t min_inliers = 15;      ///< no keyframe is created with this number of inliers or fewer
  std::size_t close_tracked = 100;   ///< a keyframe is created with fewer tracked close points than this ...
  std::size_t close_untracked = 70;  ///< ... and more untracked close points than this
};

/// Local bundle adjustment after each keyframe.
struct adjustment_options {
  std::size_t keyframes = 12;   ///< number of keyframes that move: the newest and those sharing most with it; 0: none
  std::size_t min_shared = 15;  ///< minimum number of landmarks that these share with the newest keyframe
  int robust_iterations = 5;    ///< maximum number of iterations with all observations
  int iterations = 5;           ///< maximum number of iterations without the outliers
};

/// Removal of unreliable landmarks and redundant keyframes.
struct culling_options {
  double found_ratio = 0.25;        ///< minimum share of the frames expecting a landmark in which it is found ...
  std::uint32_t min_visible = 8;    ///< ... applied once this number of frames has expected it
  std::uint32_t age = 2;            ///< keyframes after the one that created it, by which a landmark must have ...
  std::uint32_t min_support = 4;    ///< ... this number of observations, where those with depth count twice
  std::uint32_t least_support = 0;  ///< minimum support of a landmark of any higher age; below it is removed
  std::size_t neighborhood = 20;    ///< number of keyframes around the newest one that are examined
  double redundant = 0.9;           ///< a keyframe is redundant if this share of its close landmarks is observed by ...
  std::size_t redundant_observers = 3;  ///< ... this number of other keyframes ...
  int coarser_levels = 1;               ///< ... each at most this number of pyramid levels coarser
};

/// Depth images in pose estimation: points of a frame are aligned with the surfaces of keyframes. For sensors with a
/// depth image.
struct depth_term_options {
  bool enabled = true;           ///< adds the depth term to the keypoints in every pose refinement
  bool recovers = true;          ///< localises the camera by depth where keypoints fail
  std::size_t points = 400;      ///< maximum number of points of a frame
  double effective_points = 40;  ///< maximum effective number of these: neighbouring depth errors are correlated
  std::size_t surfaces = 16;     ///< maximum number of keyframe surfaces kept; about 130 kB each
  double weakest = 0.002;  ///< mean square of the surfaces' normals in a direction below which it is unconstrained
  double min_share = 0.7;  ///< minimum share of consistent points among those on known surfaces ...
  std::size_t min_points = 100;  ///< ... and minimum number of the latter, for depth to localise the camera
  std::size_t min_inliers = 5;   ///< minimum number of landmarks per direction of the pose that surfaces leave free
};

/// Measurement of landmarks in the image by patches.
struct patch_options {
  bool enabled = true;  ///< off: the positions of landmarks are those of the keypoints
  /// Exposure time of the colour image, during which it blurs if the camera moves, seconds; 0: no blur. Finite, >= 0.
  /// Empty: estimated, up to 0.032.
  std::optional<double> exposure{};
  double min_correlation = 0.8;  ///< minimum normalised correlation of a patch with the image
};

/// Recovery from lost tracking.
struct recovery_options {
  std::size_t candidates = 8;         ///< maximum number of keyframes tried for relocalisation
  std::size_t min_inliers = 40;       ///< minimum number of inliers of a relocalised frame
  double new_map_after = 1.0;         ///< seconds without a pose after which a new map begins
  std::size_t min_map_keyframes = 3;  ///< a map with fewer keyframes is then removed, with the frames tracked in it
};

/// Initialisation of a map from one camera without depth.
struct start_options {
  double radius = 100.0;           ///< search radius around a keypoint's last position, pixels
  std::uint32_t distance = 50;     ///< maximum distance of descriptors
  float ratio = 0.9F;              ///< maximum ratio of the distance to that of the second best match
  std::size_t min_features = 100;  ///< minimum number of features of a frame that may be the first
  std::size_t min_matches = 100;   ///< minimum number of matches with the first frame; with fewer it is discarded
  std::size_t max_candidates = 3;  ///< maximum number of simultaneous candidates for the first frame, 1 or more
  double deviation = 0.6;          ///< standard deviation of a keypoint, pixels of its level
  std::size_t min_points = 50;     ///< minimum number of points of a new map
  double min_parallax = 0.02;      ///< minimum median angle between the rays of these points, radians
};

/// Triangulation of keypoints without a landmark.
struct triangulation_options {
  std::size_t neighbors = 10;    ///< number of keyframes around the new one that are searched
  double min_baseline = 0.03;    ///< minimum distance of two keyframes, metres (without depth, median depths)
  double min_parallax = 0.05;    ///< minimum angle between two rays, radians
  std::uint32_t distance = 50;   ///< maximum distance of descriptors
  float ratio = 0.6F;            ///< maximum ratio of the distance to that of the second best match
  float line_distance = 1.96F;   ///< maximum distance from the epipolar line, pixels of a keypoint's level
  float epipole_radius = 10.0F;  ///< pixels of a keypoint's level around the epipole in which nothing is matched
  double scale_tolerance = 1.5;  ///< maximum factor, in addition to one level, between ratios of levels and distances
};

/// Fusion of duplicate landmarks around a new keyframe.
struct fusion_options {
  double radius = 4.0;           ///< search radius around a projection, pixels of a keypoint's level
  std::uint32_t distance = 50;   ///< maximum distance of descriptors
  std::size_t neighbors = 10;    ///< number of keyframes around the new one that are searched ...
  std::size_t second_order = 5;  ///< ... and number of neighbours of each of these
};

/// Conditions for accepting a loop.
struct loop_options {
  std::uint32_t distance = 64;   ///< maximum distance of descriptors of the two keyframes ...
  float ratio = 0.85F;           ///< ... and maximum ratio to that of the second best match
  std::size_t min_matches = 20;  ///< minimum number of matches by appearance between the two keyframes
  /// Threshold of an inlier among these, standard deviations of the depth or, where no lengths are measured, of the
  /// pixels in both images.
  double alignment_threshold = 3.0;
  std::size_t min_aligned = 12;  ///< minimum number of inliers among these
  std::size_t neighbors = 10;    ///< number of neighbours of the candidate whose landmarks are searched for as well
  double wide_radius = 12.0;     ///< search radius for landmarks around the first estimate of the pose, pixels
  double radius = 4.0;           ///< search radius around the refined pose, pixels
  std::uint32_t landmark_distance = 50;  ///< maximum distance of descriptors of landmarks
  std::size_t min_inliers = 40;         ///< minimum number of landmarks around the candidate that the keyframe observes
  std::size_t supporters = 5;           ///< number of neighbours of the keyframe that are examined ...
  std::size_t min_supporters = 2;       ///< ... of which this number (or all, if there are fewer) must agree ...
  std::size_t supporter_inliers = 20;   ///< ... by observing this number of the landmarks
  double max_translation = 0.1;         ///< drift that is always plausible, metres ...
  double translation_per_metre = 0.05;  ///< ... and in addition per metre of the path between the two keyframes
  double max_rotation = 5.0 * std::numbers::pi / 180.0;        ///< rotation that is always plausible, radians ...
  double rotation_per_metre = 1.0 * std::numbers::pi / 180.0;  ///< ... and in addition per metre of the path
  /// Maximum standard deviation of the logarithm of the scale between both ends where no lengths are measured. The
  /// drift of the scale is unbounded, and of the four limits above only `max_rotation` applies.
  double max_scale_deviation = 0.02;
  std::uint64_t seed = 1;  ///< seed of RANSAC
};

/// Fusion of the landmarks of both ends of a loop, or of two maps.
struct loop_fusion_options {
  std::size_t keyframes = 15;   ///< number of keyframes around the keyframe in which landmarks are searched for
  std::size_t neighbors = 15;   ///< number of neighbours of the candidate whose landmarks are searched for
  double radius = 4.0;          ///< search radius around a projection, pixels of a keypoint's level
  std::uint32_t distance = 50;  ///< maximum distance of descriptors
};

/// Correction of a map after a loop closure.
struct loop_correction_options {
  std::uint32_t strong = 100;  ///< minimum number of shared landmarks of an edge of the essential graph
  double loop_weight = 100.0;  ///< weight of the new edge, relative to a pair that shares `strong` landmarks
  int iterations = 20;         ///< maximum number of iterations of the pose graph
  loop_fusion_options fusion{};
};

/// Bundle adjustment of a whole map.
struct global_adjustment_options {
  int robust_iterations = 10;         ///< maximum number of iterations with all observations
  int iterations = 20;                ///< maximum number of iterations without the outliers
  double relative_tolerance = 1e-6;   ///< either stage ends when a step lowers the cost by less than this share
  std::size_t min_observations = 10;  ///< a keyframe with fewer observations follows its parent in the spanning tree
};

/// Place recognition, loop closing and map merging.
struct place_options {
  bool enabled = true;           ///< off: no loops are closed and no maps merged; relocalisation still works
  std::size_t candidates = 5;    ///< maximum number of keyframes that a new keyframe is compared with
  std::uint32_t apart = 10;      ///< minimum number of keyframes between the two ends of a loop, and between two loops
  bool adjusts_globally = true;  ///< adjusts the map globally after each loop and merger
  loop_options loop{};
  loop_correction_options correction{};
  global_adjustment_options adjustment{};
};

/// Detection of moving objects.
struct moving_options {
  bool enabled = true;            ///< off: every feature counts as part of the world
  std::size_t min_features = 20;  ///< minimum number of features that move together ...
  double share = 0.15;            ///< ... if more than this share of the matches disagrees with one pose
  double seasoned = 1.0;          ///< age at which a landmark is fully trusted to be static, seconds
  double reach = 0.2;  ///< radius around moving features in which features of unknown motion are excluded, metres
  double hold = 3.0;   ///< seconds for which moved features stay excluded after coming to rest
};

/// Threads of the system.
struct thread_options {
  /// Off: `track` does everything, and the same frames give the same bytes. On: mapping, loop closing and global
  /// adjustment have one thread each, and `track` returns as soon as the pose is known.
  bool enabled = false;
  /// Maximum number of keyframes waiting for mapping; at the limit, no more keyframes are made ...
  std::size_t max_waiting = 3;
  /// ... or `track` waits: for recordings, which must not outrun mapping. If off, an adjustment also ends early when a
  /// keyframe waits.
  bool wait = false;
};

/// `options::bf` of a depth camera that triangulates: focal length (pixels) and distance between projector and camera
/// (metres). Its disparity is accurate to about a tenth of a pixel, compared with one pixel for features of a stereo
/// pair. Source: K. Khoshelham, S. O. Elberink, "Accuracy and resolution of Kinect depth data", Sensors 2012.
[[nodiscard]] constexpr double depth_camera_bf(double focal_length, double baseline) noexcept {
  return 10.0 * focal_length * baseline;
}

/// Settings of `system`.
struct options {
  /// Settings of the default extractor. `levels` and `scale_factor` describe the pyramid of any other extractor as
  /// well.
  features::orb_options features{};
  /// Focal length times baseline of the virtual stereo camera that models the depth sensor, pixel metres: the standard
  /// deviation of a depth z is `z^2 / bf` metres (times the scale of the keypoint's level). 400 is close to the noise
  /// of a Kinect; see `depth_camera_bf`.
  double bf = 400.0;
  double min_depth = 0.1;               ///< metres; depth outside min_depth ... max_depth is not used
  double max_depth = 10.0;              ///< metres
  double close_depth = 3.2;             ///< metres; nearer points become landmarks immediately
  std::size_t min_new_landmarks = 100;  ///< minimum number of new landmarks of a keyframe, even if they are not close
  std::size_t min_start_points = 100;   ///< minimum number of keypoints (with depth, if it is measured) to begin a map
  std::size_t min_inliers = 20;         ///< minimum number of inliers of a tracked frame
  double motion_radius = 15.0;          ///< search radius around the last frame's points, pixels of a keypoint's level
  double search_radius = 4.0;  ///< search radius for landmarks around a refined pose, pixels of a keypoint's level
  std::size_t local_keyframes = 40;  ///< maximum number of keyframes whose landmarks are searched for in a frame
  camera::shutter shutter{};         ///< exposure times of the rows of the images; the default is a global shutter
  /// Estimates the shutter from the frames, starting from `shutter`, and applies significant changes during tracking:
  /// after two seconds, and each time the observation time has grown by half. The existing map is not changed, nor are
  /// the first frames of a map localised again. It costs a few milliseconds per frame. For recordings: estimate from
  /// the first seconds (`system::estimated_shutter`), then restart with the result.
  bool estimates_shutter = false;
  keyframe_options keyframes{};
  adjustment_options adjustment{};
  culling_options culling{};
  recovery_options recovery{};
  /// Off for one camera without depth (`monocular_options`): a map begins with two frames with enough parallax between
  /// them, lengths are in an arbitrary unit per map, and scale drift is corrected at loops.
  bool scale_is_measured = true;
  start_options start{};
  depth_term_options depth_term{};
  patch_options patches{};
  place_options places{};
  triangulation_options triangulation{};
  fusion_options fusion{};
  moving_options moving{};
  thread_options threads{};
  /// Maximum total number of frames in the trajectories of all maps: the latest tracked frames are kept. For robots
  /// that run for days; a frame takes 72 bytes. If limited, the active map forgets the poses of erased keyframes that
  /// none of these frames refers to, except the latest ones (`basic_map::remembers`).
  std::size_t trajectory_frames = std::numeric_limits<std::size_t>::max();
  bool localization_only = false;     ///< makes no keyframes and keeps the map unchanged: for a loaded map
  std::optional<se3> initial_pose{};  ///< `T_world_camera` of the first frame of a map; default: the identity
  /// Function that returns the initial pose and replaces `initial_pose`: the tracking thread calls it when a map begins
  /// with a frame (without depth: with the second of two frames, whose pose it returns). It must not call the system.
  std::function<se3()> find_initial_pose{};
  std::uint64_t seed = 1;  ///< seed of RANSAC
};

/// Returns the settings of a rectified stereo camera with focal length `focal` (pixels) and `baseline` (metres), based
/// on `settings`. Sets `bf`, the range of depth (from one baseline to a disparity of one pixel), and `close_depth` to
/// 40 baselines, up to which the depth of a single pair is accurate enough (R. Mur-Artal, J. D. Tardos, "ORB-SLAM2",
/// T-RO 33 (2017), section III.A). Farther points become landmarks by parallax. @pre focal > 0, baseline > 0
[[nodiscard]] inline options stereo_options(double focal, double baseline, options settings = {}) {
  assert(focal > 0.0 && baseline > 0.0);
  settings.bf = focal * baseline;
  settings.min_depth = baseline;
  settings.max_depth = settings.bf;
  settings.close_depth = std::min(40.0 * baseline, settings.max_depth);
  return settings;
}

/// Returns the settings of a camera without depth, based on `settings`. `keyframes.moved` and
/// `triangulation.min_baseline` are then fractions of the median depth of the landmarks in view. More keyframes are
/// made, for the triangulation of landmarks, and landmarks need three keyframes. The values follow R. Mur-Artal, J. M.
/// M. Montiel, J. D. Tardos, "ORB-SLAM", T-RO 31 (2015), where that paper specifies them.
[[nodiscard]] inline options monocular_options(options settings = {}) {
  settings.scale_is_measured = false;
  settings.keyframes.moved = 0.03;
  settings.keyframes.inlier_ratio = settings.keyframes.inlier_ratio_start = 0.9;
  settings.culling.min_support = 3;
  settings.culling.least_support = 2;
  settings.triangulation.neighbors = 20;
  settings.triangulation.min_baseline = 0.01;
  settings.triangulation.min_parallax = 0.02;
  settings.fusion.neighbors = 20;
  settings.recovery.min_map_keyframes = 5;
  settings.moving.enabled = false;
  settings.depth_term.enabled = settings.depth_term.recovers = false;
  settings.places.loop.max_rotation = 60.0 * std::numbers::pi / 180.0;
  return settings;
}

}  // namespace orbis::slam

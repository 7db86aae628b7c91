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

/// When a frame becomes a keyframe.
struct keyframe_options {
  double interval = 0.3;  ///< seconds since the last keyframe, after which motion is a sufficient reason
  double moved =
      0.06;  ///< metres (without depth, median depths of the view) since the last keyframe that count as motion ...
  double turned = 0.06;              ///< ... or radians
  double inlier_ratio = 0.75;        ///< a keyframe is made below this share of the reference keyframe's landmarks
  double inlier_ratio_start = 0.4;   ///< the share while the map has one keyframe
  std::size_t min_inliers = 15;      ///< no keyframe is made with fewer inliers, or as many
  std::size_t close_tracked = 100;   ///< a keyframe is made with fewer tracked close points than this ...
  std::size_t close_untracked = 70;  ///< ... and more untracked close points than this
};

/// Local bundle adjustment after each keyframe.
struct adjustment_options {
  std::size_t keyframes = 12;   ///< number of keyframes that move: the newest and those that share most; 0: none
  std::size_t min_shared = 15;  ///< shared landmarks of these with the newest keyframe, at least
  int robust_iterations = 5;    ///< iterations with all observations, at most
  int iterations = 5;           ///< iterations without the outliers, at most
};

/// Removal of unreliable landmarks and redundant keyframes.
struct culling_options {
  double found_ratio = 0.25;        ///< share of the frames in which a landmark is expected that have to show it ...
  std::uint32_t min_visible = 8;    ///< ... once it was expected in so many frames
  std::uint32_t age = 2;            ///< keyframes after the one that created it, when a landmark must have ...
  std::uint32_t min_support = 4;    ///< ... so many observations, where those with depth count twice
  std::uint32_t least_support = 0;  ///< of a landmark of any higher age, below which it is removed
  std::size_t neighborhood = 20;    ///< keyframes around the newest one that are examined
  double redundant = 0.9;           ///< a keyframe is redundant if this share of its close landmarks is observed by ...
  std::size_t redundant_observers = 3;  ///< ... so many other keyframes ...
  int coarser_levels = 1;               ///< ... at most so many pyramid levels coarser
};

/// The depth image in the pose: points of a frame against the surfaces of keyframes. For sensors with a depth image.
struct depth_term_options {
  bool enabled = true;           ///< joins the keypoints wherever a pose is refined
  bool recovers = true;          ///< holds the camera where keypoints do not
  std::size_t points = 400;      ///< of a frame, at most
  double effective_points = 40;  ///< that they count as at most: neighbouring depths err together
  std::size_t surfaces = 16;     ///< of keyframes that are kept, at most; about 130 kB each
  double weakest = 0.002;        ///< mean square of the surfaces' directions below which these leave one free
  double min_share = 0.7;        ///< of the points that lie on known surfaces, where depth alone holds the camera ...
  std::size_t min_points = 100;  ///< ... and how many, at least
  std::size_t min_inliers = 5;   ///< landmarks that hold what surfaces leave free
};

/// What is done when tracking is lost.
struct recovery_options {
  std::size_t candidates = 8;         ///< keyframes that relocalisation is tried with, at most
  std::size_t min_inliers = 40;       ///< of a relocalised frame
  double new_map_after = 1.0;         ///< seconds without a pose, after which a new map is begun
  std::size_t min_map_keyframes = 3;  ///< a map with fewer keyframes is then removed, with the frames tracked in it
};

/// How the map of one camera without depth begins.
struct start_options {
  double radius = 100.0;           ///< of the search for a keypoint around its last place, pixels
  std::uint32_t distance = 50;     ///< of descriptors, at most
  float ratio = 0.9F;              ///< of the distance to that of the second best match, at most
  std::size_t min_features = 100;  ///< of a frame that may be the first
  std::size_t min_matches = 100;   ///< with the first frame, below which it is given up
  std::size_t max_candidates = 3;  ///< frames that may be the first, at a time, 1 or more
  double deviation = 0.6;          ///< of a keypoint, pixels of its level
  std::size_t min_points = 50;     ///< that a map begins with
  double min_parallax = 0.02;      ///< median angle between the rays of these, at least, radians
};

/// Triangulation of keypoints without landmark.
struct triangulation_options {
  std::size_t neighbors = 10;    ///< keyframes around the new one that are searched
  double min_baseline = 0.03;    ///< metres (without depth, median depths) between two keyframes, at least
  double min_parallax = 0.05;    ///< radians between two rays, at least
  std::uint32_t distance = 50;   ///< of descriptors, at most
  float ratio = 0.6F;            ///< of the distance to that of the second best match, at most
  float line_distance = 1.96F;   ///< from the epipolar line, pixels of a keypoint's level, at most
  float epipole_radius = 10.0F;  ///< pixels of a keypoint's level around the epipole in which nothing is matched
  double scale_tolerance = 1.5;  ///< factor, besides one level, between the ratios of levels and of distances, at most
};

/// Fusion of duplicate landmarks around a new keyframe.
struct fusion_options {
  double radius = 4.0;           ///< of the search around a projection, pixels of a keypoint's level
  std::uint32_t distance = 50;   ///< of descriptors, at most
  std::size_t neighbors = 10;    ///< keyframes around the new one that are searched ...
  std::size_t second_order = 5;  ///< ... and neighbours of each of these
};

/// The conditions for a loop.
struct loop_options {
  std::uint32_t distance = 64;           ///< of descriptors of the two keyframes, at most ...
  float ratio = 0.85F;                   ///< ... and of that of the second best match
  std::size_t min_matches = 20;          ///< by appearance, between the two keyframes
  double alignment_threshold = 3.0;      ///< of an inlier among these, standard deviations of the depth or, where no
                                         ///< lengths are measured, of the pixels in both images
  std::size_t min_aligned = 12;          ///< inliers among these, at least
  std::size_t neighbors = 10;            ///< of the candidate, whose landmarks are searched for as well
  double wide_radius = 12.0;             ///< of the search for landmarks around the first estimate of the pose, pixels
  double radius = 4.0;                   ///< of the search around the refined pose, pixels
  std::uint32_t landmark_distance = 50;  ///< of descriptors of landmarks, at most
  std::size_t min_inliers = 40;          ///< landmarks around the candidate that the keyframe must observe
  std::size_t supporters = 5;            ///< neighbours of the keyframe that are examined ...
  std::size_t min_supporters = 2;        ///< ... of which so many (or all, if there are fewer) must agree ...
  std::size_t supporter_inliers = 20;    ///< ... by observing so many of the landmarks
  double max_translation = 0.1;          ///< drift that is always plausible, metres ...
  double translation_per_metre = 0.05;   ///< ... and in addition per metre of the path between the two keyframes
  double max_rotation = 5.0 * std::numbers::pi / 180.0;        ///< rotation that is always plausible, radians ...
  double rotation_per_metre = 1.0 * std::numbers::pi / 180.0;  ///< ... and in addition per metre of the path
  /// Where no lengths are measured, standard deviation of the logarithm of the scale between both ends, at most; drift
  /// of the scale has no bound, and of the four above only `max_rotation` counts.
  double max_scale_deviation = 0.02;
  std::uint64_t seed = 1;  ///< of RANSAC
};

/// Fusion of the landmarks of both ends of a loop, or of two maps.
struct loop_fusion_options {
  std::size_t keyframes = 15;   ///< around the keyframe, in which landmarks are searched for
  std::size_t neighbors = 15;   ///< of the candidate, whose landmarks these are
  double radius = 4.0;          ///< of the search around a projection, pixels of a keypoint's level
  std::uint32_t distance = 50;  ///< of descriptors, at most
};

/// Correction of a map after a loop was found.
struct loop_correction_options {
  std::uint32_t strong = 100;  ///< shared landmarks from which on a pair is an edge of the essential graph
  double loop_weight = 100.0;  ///< of the new edge, relative to a pair that shares `strong` landmarks
  int iterations = 20;         ///< of the pose graph, at most
  loop_fusion_options fusion{};
};

/// Bundle adjustment of a whole map.
struct global_adjustment_options {
  int robust_iterations = 10;         ///< iterations with all observations, at most
  int iterations = 20;                ///< iterations without the outliers, at most
  double relative_tolerance = 1e-6;   ///< either ends when a step lowers the cost by less than this share
  std::size_t min_observations = 10;  ///< a keyframe with fewer follows its parent in the spanning tree
};

/// Place recognition, and what follows from it.
struct place_options {
  bool enabled = true;           ///< off: no loops are closed and no maps merged; relocalisation still works
  std::size_t candidates = 5;    ///< that a new keyframe is compared with, at most
  std::uint32_t apart = 10;      ///< keyframes between the two ends of a loop, and between two loops, at least
  bool adjusts_globally = true;  ///< whether the map is adjusted globally after each loop and merger
  loop_options loop{};
  loop_correction_options correction{};
  global_adjustment_options adjustment{};
};

/// What moves through the view.
struct moving_options {
  bool enabled = true;            ///< off: every feature counts as part of the world
  std::size_t min_features = 20;  ///< that move together, at least ...
  double share = 0.15;            ///< ... where more than this share of the matches does not agree with one pose
  double seasoned = 1.0;          ///< age at which a landmark is trusted fully to stand still, seconds
  double reach = 0.2;             ///< around what moves, in which features of unknown motion are left out, metres
  double hold = 3.0;              ///< seconds that what has moved stays left out while it stands still
};

/// Threads of the system.
struct thread_options {
  /// Off: `track` does everything, and the same frames give the same bytes. On: mapping, loop closing and global
  /// adjustment have one thread each, and `track` returns as soon as the pose is known.
  bool enabled = false;
  std::size_t max_waiting = 3;  ///< keyframes that may wait for mapping; with so many no further one is made, ...
  /// ... or `track` waits: for recordings, which must not outrun the mapping. Otherwise an adjustment also ends early
  /// where a keyframe waits.
  bool wait = false;
};

/// `options::bf` of a depth camera that triangulates: focal length (pixels) and distance of projector and camera
/// (metres). Its disparity is good to about a tenth of a pixel, where that of a stereo pair's features is good to one.
/// Source: K. Khoshelham, S. O. Elberink, "Accuracy and resolution of Kinect depth data", Sensors 2012.
[[nodiscard]] constexpr double depth_camera_bf(double focal_length, double baseline) noexcept {
  return 10.0 * focal_length * baseline;
}

/// The options of `system`.
struct options {
  /// Of the default extractor. `levels` and `scale_factor` describe the pyramid of any other extractor as well.
  features::orb_options features{};
  /// Focal length times the baseline of the virtual stereo camera that stands for the depth sensor, pixel metres: the
  /// standard deviation of a depth z is `z^2 / bf` metres (times the scale of the keypoint's level). 400 is close to
  /// the noise of a Kinect; see `depth_camera_bf`.
  double bf = 400.0;
  double min_depth = 0.1;               ///< metres; depth outside of min_depth ... max_depth is not used
  double max_depth = 10.0;              ///< metres
  double close_depth = 3.2;             ///< metres; nearer points become landmarks at once
  std::size_t min_new_landmarks = 100;  ///< new landmarks of a keyframe, even if they are not close
  std::size_t min_start_points = 100;   ///< keypoints with depth (if it is measured) that a map needs to begin
  std::size_t min_inliers = 20;         ///< of a tracked frame
  double motion_radius = 15.0;          ///< of the search around the last frame's points, pixels of a keypoint's level
  double search_radius = 4.0;           ///< of the search for landmarks around a refined pose, likewise
  std::size_t local_keyframes = 40;     ///< whose landmarks are searched for in a frame, at most
  camera::shutter shutter{};            ///< when the rows of the images are taken; the default is a global shutter
  /// Estimates the shutter from the frames, beginning with `shutter`, and takes to what is significant while it goes
  /// on: after two seconds, and each time the number of frames has doubled. What the map holds by then stays as it is.
  /// It costs a few milliseconds a frame. For recordings: estimate from the first seconds
  /// (`system::estimated_shutter`), then begin again with the result.
  bool estimates_shutter = false;
  keyframe_options keyframes{};
  adjustment_options adjustment{};
  culling_options culling{};
  recovery_options recovery{};
  /// Off for one camera without depth (`monocular_options`): a map begins with two frames between which there is enough
  /// parallax, lengths are in a unit of the map's own, and their drift is corrected at loops.
  bool scale_is_measured = true;
  start_options start{};
  depth_term_options depth_term{};
  place_options places{};
  triangulation_options triangulation{};
  fusion_options fusion{};
  moving_options moving{};
  thread_options threads{};
  /// The trajectories of all maps hold so many frames together, at most: the latest of those that were tracked. For
  /// robots that run for days; a frame takes 72 bytes. If it is limited, the active map forgets where erased keyframes
  /// were that none of these frames hangs on, but for the latest (`basic_map::remembers`).
  std::size_t trajectory_frames = std::numeric_limits<std::size_t>::max();
  bool localization_only = false;     ///< no keyframes are made, and the map is kept unchanged: for a loaded map
  std::optional<se3> initial_pose{};  ///< `T_world_camera` of the first frame of a map; default: the identity
  /// The same, asked for by tracking's thread when a map begins with a frame (of two, without depth, it is the pose of
  /// the second one, with which it is asked for); `initial_pose` does not count then. It must not call the system.
  std::function<se3()> find_initial_pose{};
  std::uint64_t seed = 1;  ///< of RANSAC
};

/// The settings of a rectified stereo camera of focal length `focal` (pixels) and `baseline` (metres), on top of
/// others: `bf`, the range of depth from a baseline to a disparity of a pixel, and points as close as 40 baselines,
/// whose depth a single pair tells well enough (R. Mur-Artal, J. D. Tardos, "ORB-SLAM2", T-RO 33 (2017), section
/// III.A). Points farther than these become landmarks by parallax. @pre focal > 0, baseline > 0
[[nodiscard]] inline options stereo_options(double focal, double baseline, options settings = {}) {
  assert(focal > 0.0 && baseline > 0.0);
  settings.bf = focal * baseline;
  settings.min_depth = baseline;
  settings.max_depth = settings.bf;
  settings.close_depth = std::min(40.0 * baseline, settings.max_depth);
  return settings;
}

/// The settings of a camera without depth, on top of others. Lengths of `keyframes.moved` and
/// `triangulation.min_baseline` are then shares of the median depth of the landmarks in view. More keyframes are made,
/// for landmarks to be triangulated by, and landmarks need three of them. The figures are those of R. Mur-Artal, J. M.
/// M. Montiel, J. D. Tardos, "ORB-SLAM", T-RO 31 (2015), where it gives them.
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

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
#include <orbis/slam/shutter_estimate.hpp>

namespace orbis::slam {

/// Conditions under which a frame becomes a keyframe.
struct keyframe_options {
  double interval = 0.3;  ///< seconds since the last keyframe after which motion alone triggers a new one
  /// Translation since the last keyframe that counts as motion, metres; without depth, in units of the median depth.
  double moved = 0.06;
  double turned = 0.06;  ///< rotation since the last keyframe that counts as motion, radians
  /// Rotation that triggers a new keyframe at once, relative to the last keyframe and to the reference, radians.
  double max_turned = 0.15;
  double inlier_ratio = 0.75;       ///< a frame with a smaller share of the reference's landmarks becomes a keyframe
  double inlier_ratio_start = 0.4;  ///< `inlier_ratio` while the map has only one keyframe
  std::size_t min_inliers = 15;     ///< no keyframe is created with this number of inliers or fewer
  /// A frame also becomes a keyframe if it has fewer tracked close points than this, and more untracked close points
  /// than `close_untracked`.
  std::size_t close_tracked = 100;
  std::size_t close_untracked = 70;  ///< see `close_tracked`
};

/// Local bundle adjustment after each keyframe.
struct adjustment_options {
  std::size_t keyframes = 12;   ///< number of adjusted keyframes: the newest and those most covisible with it; 0: none
  std::size_t min_shared = 15;  ///< minimum number of landmarks that an adjusted keyframe shares with the newest
  int robust_iterations = 5;    ///< maximum number of iterations with all observations
  int iterations = 5;           ///< maximum number of iterations after exclusion of the outliers
};

/// Removal of unreliable landmarks and redundant keyframes.
struct culling_options {
  double found_ratio = 0.25;        ///< minimum share of a landmark's expected observations that are found
  std::uint32_t min_visible = 8;    ///< number of expected observations from which `found_ratio` applies
  std::uint32_t age = 2;            ///< number of keyframes after a landmark's creation at which `min_support` applies
  std::uint32_t min_support = 4;    ///< minimum number of observations at `age`; those with depth count twice
  std::uint32_t least_support = 0;  ///< minimum number of observations of older landmarks; 0: no minimum
  std::size_t neighborhood = 20;    ///< number of keyframes examined around the newest one
  double redundant = 0.9;           ///< a keyframe is redundant if others observe this share of its close landmarks
  std::size_t redundant_observers = 3;  ///< for `redundant`: number of other keyframes that must observe a landmark
  int coarser_levels = 1;               ///< for `redundant`: number of levels by which the observations may be coarser
};

/// Use of depth images in pose estimation: points of a frame are aligned with surfaces of keyframes. For sensors with a
/// depth image.
struct depth_term_options {
  bool enabled = true;           ///< adds the depth term to the keypoint residuals in every pose refinement
  bool recovers = true;          ///< localises the camera by depth when localisation by keypoints fails
  std::size_t points = 400;      ///< maximum number of points per frame
  double effective_points = 40;  ///< maximum total weight, in independent points: neighbouring errors are correlated
  std::size_t surfaces = 16;     ///< maximum number of keyframe surfaces kept; about 130 kB each
  double weakest = 0.002;        ///< directions with a smaller mean squared normal component count as unconstrained
  double min_share = 0.7;        ///< for localisation by depth: minimum share of the points on surfaces that fit them
  std::size_t min_points = 100;  ///< for localisation by depth: minimum number of points on known surfaces
  std::size_t min_inliers = 5;   ///< minimum number of landmarks per pose direction not constrained by surfaces
};

/// Measurement of landmark positions in the image by patch matching.
struct patch_options {
  bool enabled = true;  ///< off: keypoint positions are used
  /// Exposure time of the colour image, seconds, which determines motion blur; 0: no blur. Finite, >= 0. Empty:
  /// estimated, up to 0.032.
  std::optional<double> exposure{};
  double min_correlation = 0.8;  ///< minimum normalised correlation of a patch with the image
};

/// Recovery from lost tracking.
struct recovery_options {
  std::size_t candidates = 8;         ///< maximum number of keyframes tried for relocalisation
  std::size_t min_inliers = 40;       ///< minimum number of inliers of a relocalised frame
  double new_map_after = 1.0;         ///< seconds without a pose after which a new map is started
  std::size_t min_map_keyframes = 3;  ///< maps with fewer keyframes are removed with their frames when a new map starts
};

/// Initialisation of a map from one camera without depth.
struct start_options {
  double radius = 100.0;           ///< search radius around a keypoint's last position, pixels
  std::uint32_t distance = 50;     ///< maximum descriptor distance
  float ratio = 0.9F;              ///< maximum ratio of the best to the second-best distance
  std::size_t min_features = 100;  ///< minimum number of features of the first frame
  std::size_t min_matches = 100;   ///< minimum number of matches to keep a candidate for the first frame
  std::size_t max_candidates = 3;  ///< maximum number of simultaneous candidates for the first frame, 1 or more
  double deviation = 0.6;          ///< standard deviation of a keypoint's position, pixels of its level
  std::size_t min_points = 50;     ///< minimum number of points of a new map
  double min_parallax = 0.02;      ///< minimum median parallax of the points of a new map, radians
};

/// Triangulation of keypoints without a landmark.
struct triangulation_options {
  std::size_t neighbors = 10;    ///< number of keyframes searched around the new one
  double min_baseline = 0.03;    ///< minimum keyframe distance, metres; without depth, in units of the median depth
  double min_parallax = 0.05;    ///< minimum angle between two rays, radians
  std::uint32_t distance = 50;   ///< maximum descriptor distance
  float ratio = 0.6F;            ///< maximum ratio of the best to the second-best distance
  float line_distance = 1.96F;   ///< maximum distance from the epipolar line, pixels of a keypoint's level
  float epipole_radius = 10.0F;  ///< exclusion radius around the epipole, pixels of a keypoint's level
  /// Maximum mismatch between the ratio of the distances from both cameras and the ratio of the pyramid scales, as a
  /// multiple of the scale factor of one level.
  double scale_tolerance = 1.5;
};

/// Fusion of duplicate landmarks around a new keyframe.
struct fusion_options {
  double radius = 4.0;           ///< search radius around a projection, pixels of a keypoint's level
  std::uint32_t distance = 50;   ///< maximum descriptor distance
  std::size_t neighbors = 10;    ///< number of keyframes searched around the new one
  std::size_t second_order = 5;  ///< number of keyframes searched around each of the `neighbors`
};

/// Conditions for accepting a loop.
struct loop_options {
  std::uint32_t distance = 64;   ///< maximum descriptor distance of a match between the two keyframes
  float ratio = 0.85F;           ///< maximum ratio of the best to the second-best distance
  std::size_t min_matches = 20;  ///< minimum number of descriptor matches between the two keyframes
  /// Inlier threshold for the descriptor matches, in standard deviations of the depth or, if no lengths are measured,
  /// of the pixels in both images.
  double alignment_threshold = 3.0;
  std::size_t min_aligned = 12;  ///< minimum number of inliers among the descriptor matches
  std::size_t neighbors = 10;    ///< number of neighbours of the candidate whose landmarks are also searched for
  double wide_radius = 12.0;     ///< landmark search radius at the first pose estimate, pixels of a keypoint's level
  double radius = 4.0;           ///< landmark search radius at the refined pose, pixels of a keypoint's level
  std::uint32_t landmark_distance = 50;  ///< maximum descriptor distance for landmarks
  std::size_t min_inliers = 40;         ///< minimum number of landmarks around the candidate that the keyframe observes
  std::size_t supporters = 5;           ///< maximum number of neighbours of the keyframe that are tested for agreement
  std::size_t min_supporters = 2;       ///< minimum number of neighbours that agree; all, if the keyframe has fewer
  std::size_t supporter_inliers = 20;   ///< minimum number of landmarks that an agreeing neighbour observes
  double max_translation = 0.1;         ///< fixed part of the allowed translational drift, metres
  double translation_per_metre = 0.05;  ///< additional drift allowed per metre of the path between the keyframes
  double max_rotation = 5.0 * std::numbers::pi / 180.0;        ///< fixed part of the allowed rotational drift, radians
  double rotation_per_metre = 1.0 * std::numbers::pi / 180.0;  ///< additional drift allowed per metre of the path
  /// Maximum standard deviation of the logarithm of the scale between both ends if no lengths are measured. Scale drift
  /// is then unbounded, and of the four limits above, only `max_rotation` applies.
  double max_scale_deviation = 0.02;
  std::uint64_t seed = 1;  ///< seed of RANSAC
};

/// Fusion of the landmarks at both ends of a loop, or of two maps.
struct loop_fusion_options {
  std::size_t keyframes = 15;   ///< number of keyframes searched around the new one
  std::size_t neighbors = 15;   ///< number of neighbours of the candidate that contribute landmarks
  double radius = 4.0;          ///< search radius around a projection, pixels of a keypoint's level
  std::uint32_t distance = 50;  ///< maximum descriptor distance
};

/// Correction of a map after a loop closure.
struct loop_correction_options {
  std::uint32_t strong = 100;  ///< minimum number of shared landmarks for an edge of the essential graph
  double loop_weight = 100.0;  ///< weight of the loop edge relative to an edge with `strong` shared landmarks
  int iterations = 20;         ///< maximum number of iterations of pose graph optimisation
  loop_fusion_options fusion{};
};

/// Bundle adjustment of a whole map.
struct global_adjustment_options {
  int robust_iterations = 10;         ///< maximum number of iterations with all observations
  int iterations = 20;                ///< maximum number of iterations after exclusion of the outliers
  double relative_tolerance = 1e-6;   ///< each stage ends when a step reduces the cost by less than this fraction
  std::size_t min_observations = 10;  ///< a keyframe with fewer observations follows its parent in the spanning tree
};

/// Place recognition, loop closing and map merging.
struct place_options {
  bool enabled = true;           ///< off: no loops are closed and no maps merged; relocalisation still works
  std::size_t candidates = 5;    ///< maximum number of keyframes that a new keyframe is compared with
  std::uint32_t apart = 10;      ///< minimum number of keyframes between the two ends of a loop, and between two loops
  bool adjusts_globally = true;  ///< runs global adjustment after each loop closure and merge
  loop_options loop{};
  loop_correction_options correction{};
  global_adjustment_options adjustment{};
};

/// Detection of moving objects.
struct moving_options {
  bool enabled = true;            ///< off: every feature counts as static
  std::size_t min_features = 20;  ///< minimum number of features of a moving object
  /// A moving object is searched for if more than this share of the matches disagrees with a single camera pose.
  double share = 0.15;
  double seasoned = 1.0;  ///< age at which a landmark is fully trusted to be static, seconds
  double reach = 0.2;  ///< radius around moving features within which features of unknown motion are excluded, metres
  double hold = 3.0;   ///< seconds for which moved features stay excluded after coming to rest
};

/// Threads of the system.
struct thread_options {
  /// Off: `track` does all the work, and the same frames give bit-identical results. On: mapping, loop closing and
  /// global adjustment have one thread each, and `track` returns as soon as the pose is known.
  bool enabled = false;
  /// Maximum number of keyframes waiting for mapping; `wait` specifies what happens at the limit.
  std::size_t max_waiting = 3;
  /// True: at the limit, `track` waits; for recordings, so that tracking does not outrun mapping. False: at the limit,
  /// no more keyframes are created; in addition, an adjustment ends early when a keyframe is waiting.
  bool wait = false;
};

/// Returns `options::bf` for a triangulating depth camera, given its focal length (pixels) and the distance between its
/// projector and camera (metres). The disparity of such a camera is accurate to about a tenth of a pixel, compared with
/// one pixel for features of a stereo pair. Source: K. Khoshelham, S. O. Elberink, "Accuracy and resolution of Kinect
/// depth data", Sensors 2012.
[[nodiscard]] constexpr double depth_camera_bf(double focal_length, double baseline) noexcept {
  return 10.0 * focal_length * baseline;
}

/// Settings of `system`.
struct options {
  /// Settings of the default extractor. `levels` and `scale_factor` describe the pyramid of any other extractor as
  /// well.
  features::orb_options features{};
  /// Focal length times baseline of the virtual stereo camera that models the depth sensor, in pixel metres: the
  /// standard deviation of a depth z is `z^2 / bf` metres (times the scale of the keypoint's level). 400 is close to
  /// the noise of a Kinect; see `depth_camera_bf`.
  double bf = 400.0;
  double min_depth = 0.1;               ///< metres; depth outside [min_depth, max_depth] is not used
  double max_depth = 10.0;              ///< metres
  double close_depth = 3.2;             ///< metres; nearer points become landmarks immediately
  std::size_t min_new_landmarks = 100;  ///< minimum number of new landmarks per keyframe, even if they are not close
  std::size_t min_start_points = 100;   ///< minimum number of keypoints (with depth, if measured) for starting a map
  std::size_t min_inliers = 20;         ///< minimum number of inliers of a tracked frame
  double motion_radius = 15.0;          ///< search radius around the last frame's points, pixels of a keypoint's level
  double search_radius = 4.0;           ///< search radius for landmarks at a refined pose, pixels of a keypoint's level
  std::size_t local_keyframes = 40;     ///< maximum number of keyframes whose landmarks are searched for in a frame
  camera::shutter shutter{};            ///< exposure times of the image rows; the default is a global shutter
  /// Estimates the shutter from the frames, starting from `shutter`, and applies significant changes during tracking:
  /// after two seconds, and each time the observation time has grown by half. The existing map is not changed. Takes
  /// half a millisecond per frame. For recordings: estimate from the first seconds (`system::estimated_shutter`), then
  /// start another system with the result (`shutter` and `earlier_estimate`).
  bool estimates_shutter = false;
  /// With `estimates_shutter`: the estimate of another system for the same frames, from which `shutter` is taken.
  /// Tracking does not revise it before it has observed 1.5 times as much. The default: `shutter` is a guess.
  shutter_estimate earlier_estimate{};
  keyframe_options keyframes{};
  adjustment_options adjustment{};
  culling_options culling{};
  recovery_options recovery{};
  /// False for one camera without depth (`monocular_options`): a map starts from two frames with enough parallax
  /// between them, lengths are in an arbitrary unit per map, and scale drift is corrected at loops.
  bool scale_is_measured = true;
  start_options start{};
  depth_term_options depth_term{};
  patch_options patches{};
  place_options places{};
  triangulation_options triangulation{};
  fusion_options fusion{};
  moving_options moving{};
  thread_options threads{};
  /// Maximum total number of frames in the trajectories of all maps: the latest tracked frames are kept. Intended for
  /// robots that run for days; a frame takes 72 bytes. Below 100, the first frames of a map are not localised again. If
  /// limited, the active map forgets the poses of erased keyframes that none of these frames refers to, except the
  /// latest ones (`basic_map::remembers`).
  std::size_t trajectory_frames = std::numeric_limits<std::size_t>::max();
  bool localization_only = false;     ///< creates no keyframes and keeps the map unchanged: for a loaded map
  std::optional<se3> initial_pose{};  ///< `T_world_camera` of the first frame of a map; default: the identity
  /// Function that returns the initial pose, used instead of `initial_pose`. The tracking thread calls it when a frame
  /// starts a map, and uses the result as the pose of that frame (without depth, the second of two frames). It must not
  /// call the system.
  std::function<se3()> find_initial_pose{};
  std::uint64_t seed = 1;  ///< seed of RANSAC
};

/// Returns the settings of a rectified stereo camera with focal length `focal` (pixels) and `baseline` (metres), based
/// on `settings`. Sets `bf`; the depth range, from one baseline to the depth with a disparity of one pixel; and
/// `close_depth`: 40 baselines, up to which the depth from a single pair is accurate enough (R. Mur-Artal, J. D.
/// Tardos, "ORB-SLAM2", T-RO 33 (2017), section III.A). Farther points become landmarks by parallax.
/// @pre focal > 0, baseline > 0
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
/// created, for the triangulation of landmarks, and landmarks must be observed by three keyframes. The values follow R.
/// Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM", T-RO 31 (2015), where that paper specifies them.
[[nodiscard]] inline options monocular_options(options settings = {}) {
  settings.scale_is_measured = false;
  settings.keyframes.moved = 0.03;
  settings.keyframes.max_turned = std::numeric_limits<double>::infinity();  // rotation alone gives no parallax
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

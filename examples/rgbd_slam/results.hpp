// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Everything a run finds out. What is not known is empty, and comes out as null.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <orbis/camera/shutter.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/slam/frame.hpp>

#include "frame_ranges.hpp"

namespace app {

/// Median, 95th percentile and mean of a list; NaN where it is empty.
struct spread {
  double median, p95, mean;
};
[[nodiscard]] spread spread_of(std::vector<double> values);

/// An occupied cube of the map.
struct voxel {
  orbis::vec3f center;
  float size;           ///< edge, metres
  orbis::rgb8 color{};  ///< mean colour of the cloud's points in it
};

struct tree_numbers {
  std::size_t leaves = 0, occupied = 0, free = 0;
  std::uintmax_t bt_bytes = 0;
};

struct map_results {
  orbis::point_cloud cloud;         ///< before the filter
  std::vector<std::uint32_t> kept;  ///< which of its points the filter kept
  std::string filter_mode, filter_reason;
  std::uintmax_t cloud_bytes = 0, filtered_bytes = 0;  ///< of the files
  double resolution = 0.0;
  tree_numbers unfiltered, filtered;
  std::uintmax_t ot_bytes = 0;
  std::vector<double> insert_ms;  ///< of each frame that went into the map
  std::vector<voxel> voxels_unfiltered, voxels;
  std::optional<double> error_m;  ///< RMS distance of the filtered cloud to the true surface
};

/// A pose, the true one that belongs to it (moved into the estimate's world), and how far off it is.
struct compared_pose {
  double timestamp;
  orbis::vec3 estimate, truth;
  double error_m;
};

struct accuracy {
  double ate_rmse_m, ate_mean_m, ate_median_m, ate_max_m;
  std::optional<double> rpe_trans_rmse_m, rpe_rot_rmse_deg;
  std::vector<compared_pose> poses;
  double scale = 1.0;           ///< metres of the truth per unit of length of the estimate
  orbis::se3 T_truth_estimate;  ///< aligns the estimate's world with the truth's, by the positions (ATE)
  orbis::se3 T_truth_map;       ///< aligns them by positions and orientations: well determined on a short path too
};

/// The world that trajectory, clouds and maps are in. Its z is up.
struct world_results {
  std::string up_from;               ///< "gravity", "floor", "walls", "assumed", "ground truth" or "loaded map"
  std::optional<double> confidence;  ///< 0 ... 1, of what the depth image of the first frame says
};

/// When the rows of the images are taken.
struct shutter_results {
  std::string from;  ///< "given", "camera" or "estimated"
  orbis::camera::shutter shutter{};
  double read_out_deviation = std::numeric_limits<double>::quiet_NaN();  ///< of an estimate, seconds
  double delay_deviation = std::numeric_limits<double>::quiet_NaN();     ///< likewise
};

/// The camera's intrinsics that were used, pixels.
struct intrinsics_results {
  std::string from;  ///< "given", or "refined" by the recording
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;
};

struct slam_results {
  orbis::slam::sensor_kind sensor = orbis::slam::sensor_kind::rgbd;
  std::size_t keyframes_made = 0;
  /// Of lengths, for people.
  [[nodiscard]] const char* unit() const { return sensor == orbis::slam::sensor_kind::monocular ? "units" : "metres"; }
  std::size_t frames = 0, tracked = 0, lost = 0, relocalized = 0, landmarks = 0;
  std::optional<std::size_t> dropped;  ///< frames of a camera that came while tracking was busy; empty: no camera
  std::size_t loops_closed = 0, maps_merged = 0, keyframes_culled = 0;
  shutter_results shutter;
  intrinsics_results intrinsics;
  frame_ranges lost_frames;
  std::vector<double> tracking_ms;  ///< of each frame: until tracking is ready for the next one
  std::vector<double> slam_ms;      ///< of it, in SLAM
  double seconds = 0.0;             ///< reading and tracking
  orbis::trajectory trajectory, keyframes;
  /// What was tracked in maps that were never joined with this one: those with most frames first, each in a world of
  /// its own.
  std::vector<orbis::trajectory> other_maps;
};

/// Of the map that grew while the camera moved.
struct live_results {
  std::vector<double> insert_ms;        ///< of each keyframe: the work
  std::vector<double> delay_ms;         ///< of each keyframe: from when it was made until it was in the map
  std::size_t behind_frames_max = 0;    ///< by how many frames tracking was ahead of a keyframe's insertion
  std::size_t frames = 0;               ///< between keyframes, that were in the map for a while
  std::vector<double> frame_delay_ms;   ///< of each of them, as delay_ms
  std::size_t dropped_frames = 0;       ///< between keyframes, that came in too fast
  std::size_t refused_frames = 0;       ///< between keyframes, whose keyframe was not in the map
  std::vector<double> correction_ms;    ///< of each correction: what moved keyframes took
  std::size_t dropped = 0;              ///< keyframes that came in too fast; they enter the map in the end
  std::optional<orbis::error> trouble;  ///< a depth image that could not be kept or read
  std::optional<orbis::error> stopped;  ///< why the map stopped growing; it is made in the end instead
};

/// What a robot can do with the map.
struct navigation_results {
  double robot_radius = 0.0;        ///< metres
  std::optional<double> floor_m;    ///< its height; empty: no floor was found
  double free_m2 = 0.0;             ///< where the robot can drive
  std::string path_status;          ///< "found", or why there is no path
  bool drives = false;              ///< the path is on the floor, otherwise that of a ball through the air
  std::vector<orbis::vec3> path{};  ///< metres
  double path_m = 0.0, straight_m = 0.0, planning_ms = 0.0;
  std::optional<orbis::error> unsaved;  ///< why the floor map that was asked for could not be written
};

struct results {
  std::string command, title;
  std::string profile;                                     ///< one of `profile_names`
  std::string images_of;                                   ///< as in `frame_source`
  std::filesystem::path folder;                            ///< where the files are made
  std::filesystem::path out;                               ///< where they are in the end
  std::vector<std::string> files, files_of_earlier_runs;   ///< names of what is in `out` in the end
  std::vector<std::pair<std::string, std::string>> setup;  ///< what was used, in words
  std::optional<world_results> world;                      ///< empty: that of a cloud, which nobody turned
  orbis::vec3 origin = orbis::vec3::Zero();                ///< of the results in coordinates of the input, metres
  std::optional<slam_results> slam;
  std::optional<live_results> live;
  std::optional<map_results> map;
  std::optional<navigation_results> navigation;
  std::optional<accuracy> against_truth;
  std::string truth_note;  ///< why there is no comparison, or what it compares
  std::vector<std::string> warnings;
  double wall_s = 0.0;
};

}  // namespace app

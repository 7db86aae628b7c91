// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The results of a run. Unknown values are empty, and null in summary.json.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <orbis/camera/shutter.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/slam/frame.hpp>
#include <orbis/slam/shutter_estimate.hpp>

#include "frame_ranges.hpp"

namespace app {

/// Median, 95th percentile and mean of a list; NaN for an empty list.
struct spread {
  double median, p95, mean;
};
[[nodiscard]] spread measure_spread(std::vector<double> values);

/// An occupied cube of the map.
struct voxel {
  orbis::vec3f center;
  float size;           ///< edge length, metres
  orbis::rgb8 color{};  ///< mean colour of the points in the cube
};

struct tree_numbers {
  std::size_t leaves = 0, occupied = 0, free = 0;
  std::uintmax_t bt_bytes = 0;
};

struct map_results {
  orbis::point_cloud cloud;         ///< before the filter
  std::vector<std::uint32_t> kept;  ///< indices of the points that the filter kept
  std::string filter_mode, filter_reason;
  std::size_t moving_pixels = 0, moving_keyframes = 0;  ///< removed pixels of moving objects; affected keyframes
  std::uintmax_t cloud_bytes = 0, filtered_bytes = 0;   ///< sizes of the files
  double resolution = 0.0;
  tree_numbers unfiltered, filtered;
  std::uintmax_t ot_bytes = 0;
  std::vector<double> insert_ms;  ///< time taken to insert each frame
  std::vector<voxel> voxels_unfiltered, voxels;
  std::optional<double> error_m;  ///< RMS distance of the filtered cloud to the true surface
};

/// An estimated position, the true one (in the estimate's world frame), and their distance.
struct compared_pose {
  double timestamp;
  orbis::vec3 estimate, truth;
  double error_m;
};

struct accuracy {
  double ate_rmse_m, ate_mean_m, ate_median_m, ate_max_m;
  std::optional<double> rpe_trans_rmse_m, rpe_rot_rmse_deg;
  std::string no_rpe;  ///< the reason why there is no RPE; empty if there is one
  bool truth_lacks_orientations = false;
  std::vector<compared_pose> poses;
  double scale = 1.0;           ///< metres in the ground truth per unit of length in the estimate
  orbis::se3 T_truth_estimate;  ///< alignment of the estimate with the ground truth by positions (for the ATE)
  orbis::se3 T_truth_map;       ///< alignment by positions and orientations: well determined even for a short path
};

/// The world frame of trajectory, clouds and maps. Its z axis points up.
struct world_results {
  std::string up_from;               ///< "gravity", "floor", "walls", "assumed", "ground truth" or "loaded map"
  std::optional<double> confidence;  ///< share of the first depth image's blocks that determine it, 0 ... 1
};

/// The camera's shutter.
struct shutter_results {
  std::string from;  ///< "given", "camera", "typical" or "estimated"
  orbis::camera::shutter shutter{};
  orbis::slam::shutter_estimate estimate{};  ///< if it can be revised

  /// True if tracking estimates the shutter and can revise it.
  [[nodiscard]] bool can_be_revised() const { return from == "typical" || from == "estimated"; }
};

/// The camera intrinsics of the run, pixels.
struct intrinsics_results {
  std::string from;  ///< "given" or "refined" (calibrated with the recording)
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;
};

struct slam_results {
  double exposure = 0.0;  ///< exposure time estimated from the motion blur of the colour images, seconds; 0: no blur
  orbis::slam::sensor_kind sensor = orbis::slam::sensor_kind::rgbd;
  std::size_t keyframes_made = 0;
  /// The unit of lengths, for display.
  [[nodiscard]] const char* unit() const { return sensor == orbis::slam::sensor_kind::monocular ? "units" : "metres"; }
  std::size_t frames = 0, tracked = 0, lost = 0, relocalized = 0, landmarks = 0;
  std::optional<std::size_t> dropped;  ///< frames of a live camera dropped while tracking was busy; empty: not live
  std::size_t loops_closed = 0, maps_merged = 0, keyframes_culled = 0;
  shutter_results shutter;
  intrinsics_results intrinsics;
  frame_ranges lost_frames;
  std::vector<double> tracking_ms;  ///< time per frame until tracking is ready for the next frame
  std::vector<double> slam_ms;      ///< part of `tracking_ms` spent in SLAM, per frame
  double seconds = 0.0;             ///< total time of reading and tracking
  orbis::trajectory trajectory, keyframes;
  /// Trajectories of maps that were not merged with this one, each in a separate world frame, largest first.
  std::vector<orbis::trajectory> other_maps;
};

/// Measurements of the live map.
struct live_results {
  std::vector<double> insert_ms;            ///< time taken to insert each keyframe
  std::vector<double> delay_ms;             ///< time from the creation of each keyframe to its insertion
  std::size_t behind_frames_max = 0;        ///< maximum number of frames tracked between creation and insertion
  std::size_t frames = 0;                   ///< inserted frames between keyframes
  std::vector<double> frame_delay_ms;       ///< delay of each inserted frame between keyframes, arrival to insertion
  std::size_t dropped_frames = 0;           ///< frames between keyframes, dropped because the map was busy
  std::size_t refused_frames = 0;           ///< frames between keyframes whose reference keyframe was not in the map
  std::vector<double> correction_ms;        ///< time taken by each correction to move keyframes
  std::size_t dropped = 0;                  ///< keyframes dropped because the map was busy; the final map contains them
  std::optional<orbis::error> depth_error;  ///< error in storing or reading a depth image
  std::optional<orbis::error> stopped;      ///< error that stopped the map; the octree is then built at the end
};

/// The floor map, and the path of a robot in the map.
struct navigation_results {
  double robot_radius = 0.0;        ///< metres
  std::optional<double> floor_m;    ///< height of the floor; empty if no floor was found
  double free_m2 = 0.0;             ///< area of the free floor, also next to obstacles
  std::string path_status;          ///< "found", or the reason why there is no path
  bool drives = false;              ///< the path is on the floor; otherwise it is a path of a flying ball
  std::vector<orbis::vec3> path{};  ///< metres
  double path_m = 0.0, straight_m = 0.0, planning_ms = 0.0;
  std::optional<orbis::error> unsaved;  ///< error in writing the requested floor map
};

struct results {
  std::string command, title;
  std::string profile;                                     ///< one of `profile_names`
  std::string images_of;                                   ///< see `frame_source::images_of`
  std::filesystem::path folder;                            ///< folder in which the files are created
  std::filesystem::path out;                               ///< output folder
  std::vector<std::string> files, files_of_earlier_runs;   ///< names of the files in `out` at the end
  std::vector<std::pair<std::string, std::string>> setup;  ///< description of input and settings
  std::optional<world_results> world;                      ///< empty for a cloud, whose world frame is unchanged
  orbis::vec3 origin = orbis::vec3::Zero();                ///< origin of the results in the input's coordinates, metres
  std::optional<slam_results> slam;
  std::optional<live_results> live;
  std::optional<map_results> map;
  std::optional<navigation_results> navigation;
  std::optional<accuracy> against_truth;
  std::string truth_note;  ///< the kind of comparison, or the reason why there is none
  std::vector<std::string> warnings;
  double wall_s = 0.0;
};

}  // namespace app

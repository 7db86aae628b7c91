// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The octree that grows while the camera moves: keyframes go in as they are made, and every correction of SLAM moves
/// them.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include <orbis/camera/rays.hpp>
#include <orbis/camera/settings.hpp>
#include <orbis/mapping/keyframe_points.hpp>
#include <orbis/mapping/live_map_thread.hpp>
#include <orbis/octree/occupancy_octree.hpp>
#include <orbis/slam/ids.hpp>

#include "map_stage.hpp"
#include "results.hpp"
#include "settings.hpp"
#include "source.hpp"

namespace app {

class live_mapping {
 public:
  using pose = orbis::mapping::keyframe_position;
  /// A keyframe as SLAM knows it, by the index of its frame.
  struct made {
    std::uint64_t frame;
    orbis::slam::map_keyframe keyframe;
  };
  /// Fills in the present poses of the keyframes that are in the active map and returns true; or false if they are
  /// those of the last call and `always` is false.
  using find_poses = std::function<bool(const std::vector<made>&, std::vector<pose>&, bool always)>;

  /// `where` is called on the map's thread until `stop`. `spill_file`: for depth images beyond what there is room for
  /// in memory, see `depth_store_options`.
  live_mapping(const frame_source& source, const settings& s, std::filesystem::path spill_file, find_poses where);

  /// Says how far tracking is.
  void tracked(std::size_t frame) { newest_ = frame; }
  /// Frame number `frame` has become a keyframe.
  void add(std::size_t frame, orbis::slam::map_keyframe keyframe, const orbis::se3& T_world_camera,
           const orbis::camera::rgbd_frame& image);
  /// Waits until the map is the one of the present poses, and ends its thread.
  void stop();

  /// What was measured. @pre stopped
  [[nodiscard]] const live_results& measured() const { return results_; }
  /// @pre stopped
  [[nodiscard]] live_octree& map() { return live_.stop(); }

 private:
  [[nodiscard]] bool poll(std::vector<pose>& poses, bool always);

  find_poses where_;
  double depth_scale_;
  orbis::camera::ray_table rays_;
  orbis::mapping::keyframe_point_options points_;
  orbis::mapping::keyframe_points reader_;
  std::mutex mutex_;
  std::vector<made> made_;  // guarded by mutex_
  std::atomic<std::size_t> newest_{0};
  live_results results_;  // written by the map's thread
  orbis::mapping::live_map_thread<live_octree::octree_type, orbis::camera::any_camera> live_;  // the first to go
};

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The octree that grows while the camera moves: keyframes go in as they are made, and every correction of SLAM moves
/// them.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
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
  using poses = orbis::mapping::keyframe_poses;
  /// A keyframe as SLAM knows it, by the index of its frame.
  struct made {
    std::uint64_t frame;
    orbis::slam::map_keyframe keyframe;
  };
  /// Fills in the present poses of the keyframes that are in the active map, and those that are in no map any more, and
  /// returns true; or false if they are those of the last call and `always` is false.
  using find_poses = std::function<bool(const std::vector<made>&, poses&, bool always)>;

  /// `where` is called on the map's thread until `stop`. `spill_file`: for depth images beyond what there is room for
  /// in memory, see `depth_store_options`.
  live_mapping(const frame_source& source, const settings& s, std::filesystem::path spill_file, find_poses where);

  /// Says how far tracking is.
  void tracked(std::size_t frame) { newest_ = frame; }
  /// Frame number `frame` has become a keyframe.
  void add(std::size_t frame, orbis::slam::map_keyframe keyframe, const orbis::se3& T_world_camera,
           const orbis::camera::rgbd_frame& image);
  /// Frame number `frame` was tracked, and has become no keyframe; its pose follows the keyframe of frame `reference`.
  void add_frame(std::size_t frame, std::uint64_t reference, const orbis::se3& T_reference_camera,
                 const orbis::camera::rgbd_frame& image);
  /// The frame of the newest keyframe for which `is_wanted(made)` holds.
  template <class IsWanted>
  [[nodiscard]] std::optional<std::uint64_t> find(const IsWanted& is_wanted) const {
    const std::lock_guard lock{mutex_};
    const auto k = std::find_if(made_.rbegin(), made_.rend(), is_wanted);
    return k == made_.rend() ? std::nullopt : std::optional{k->frame};
  }
  /// Waits until the map is the one of the present poses, and ends its thread.
  void stop();

  /// What was measured so far. From any thread.
  [[nodiscard]] live_results so_far() const;
  /// The occupied leaves of the newest map, without colours, unless it is that of revision `seen`: then false. Sets
  /// `seen`. From any thread, and without waiting for the map. O(leaves).
  [[nodiscard]] bool occupied_since(std::optional<std::uint64_t>& seen, std::vector<voxel>& cubes) const;

  /// What was measured. @pre stopped
  [[nodiscard]] const live_results& measured() const { return results_; }
  /// Nothing if it failed. @pre stopped
  [[nodiscard]] live_octree* map() { return results_.stopped ? nullptr : &live_.stop(); }

 private:
  [[nodiscard]] std::vector<made> made_so_far() const;
  [[nodiscard]] bool poll(poses& now, bool always);
  void note(const orbis::mapping::insertion_event& e);

  find_poses where_;
  double depth_scale_;
  bool waits_;  // with one thread there is one thing after the other
  orbis::camera::ray_table rays_;
  orbis::mapping::keyframe_point_options points_;
  orbis::mapping::keyframe_points reader_;  // of the map's thread
  mutable std::mutex mutex_;
  std::vector<made> made_;  // guarded by mutex_
  std::atomic<std::size_t> newest_{0};
  mutable std::mutex results_mutex_;
  live_results results_;  // written by the map's thread; guarded by results_mutex_ until `stop`
  orbis::mapping::live_map_thread<live_octree::octree_type, orbis::camera::any_camera> live_;  // the first to go
};

/// What the user should know of it.
[[nodiscard]] std::vector<std::string> live_notes(const live_results& live);

}  // namespace app

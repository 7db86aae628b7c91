// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The live map: an octree into which keyframes are inserted as they are created, and which follows corrections by
/// SLAM.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
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
  /// A SLAM keyframe and the index of its frame.
  struct made {
    std::uint64_t frame;
    orbis::slam::map_keyframe keyframe;
  };
  /// Fills in the current poses of the keyframes in the active map and the list of keyframes that are no longer in any
  /// map, and returns true. Returns false if nothing changed since the last call and `always` is false.
  using find_poses = std::function<bool(const std::vector<made>&, poses&, bool always)>;

  /// `where` is called on the map's thread until `stop`. `depths` contains the depth image of each keyframe before the
  /// keyframe is added here, and outlives this object.
  live_mapping(const frame_source& source, const settings& s, keyframe_depths& depths, find_poses where);

  /// Sets the index of the last tracked frame.
  void tracked(std::size_t frame) { newest_ = frame; }
  /// Adds the frame with index `frame`, which has become a keyframe.
  void add(std::size_t frame, orbis::slam::map_keyframe keyframe, const orbis::se3& T_world_camera,
           const orbis::image<std::uint16_t>& depth);
  /// Adds the tracked frame with index `frame`, which is not a keyframe; its pose follows the keyframe of the frame
  /// `reference`.
  void add_frame(std::size_t frame, std::uint64_t reference, const orbis::se3& T_reference_camera,
                 const orbis::image<std::uint16_t>& depth);
  /// The frame index of the newest keyframe for which `is_wanted(made)` is true.
  template <class IsWanted>
  [[nodiscard]] std::optional<std::uint64_t> find(const IsWanted& is_wanted) const {
    const std::lock_guard lock{mutex_};
    const auto k = std::find_if(made_.rbegin(), made_.rend(), is_wanted);
    return k == made_.rend() ? std::nullopt : std::optional{k->frame};
  }
  /// Waits until the map corresponds to the current poses or `leave` is called.
  void wait() { live_.wait(); }
  /// Stops calling `where`, and lets the thread end after its current step without waiting for it. May be called from
  /// any thread.
  void leave();

  /// The measurements so far. May be called from any thread.
  [[nodiscard]] live_results so_far() const;
  /// Fills in the occupied leaves of the newest map, without colours, and sets `seen` to its revision. Returns false
  /// and changes nothing if `seen` is still the current revision, or if a signal has requested the run to stop. May be
  /// called from any thread; does not wait for the map. O(leaves).
  [[nodiscard]] bool occupied_since(std::optional<std::uint64_t>& seen, std::vector<voxel>& cubes) const;

  /// Ends the thread, which may take as long as its current step. Returns the map; null if mapping failed.
  [[nodiscard]] live_octree* stop();

 private:
  [[nodiscard]] std::vector<made> inserted() const;
  [[nodiscard]] bool poll(poses& now, bool always);
  void note(const orbis::mapping::insertion_event& e);

  std::mutex where_mutex_;
  find_poses where_;  // guarded by where_mutex_
  double depth_scale_;
  bool waits_;  // with one thread, callers wait for the map
  orbis::camera::ray_table rays_;
  orbis::mapping::keyframe_point_options points_;
  orbis::mapping::keyframe_points reader_;  // used by the map's thread
  mutable std::mutex mutex_;
  std::vector<made> made_;  // guarded by mutex_
  std::atomic<std::size_t> newest_{0};
  mutable std::mutex results_mutex_;
  live_results results_;  // written by the map's thread; guarded by results_mutex_
  orbis::mapping::live_map_thread<live_octree::octree_type, orbis::camera::any_camera, live_depths>
      live_;  // destroyed first
};

/// Warnings about the live map.
[[nodiscard]] std::vector<std::string> live_notes(const live_results& live);

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A map that stays consistent with its scans: when a scan changes, is removed or arrives late, the map becomes
/// bit-identical to one built from all scans in order.
///
/// Log-odds are clamped, so the order of scans matters, and a scan cannot be subtracted, because clamping loses
/// information. Instead, the history keeps the voxels that each scan observed as free and as occupied, and replays
/// the octants of 4x4x4 voxels whose observations changed, starting from an empty state with all scans in order.
/// Replaying is cheap, because no ray is traversed again.
#pragma once

#include <chrono>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/octree/change_log.hpp>
#include <orbis/octree/detail/history/brick_uses.hpp>
#include <orbis/octree/detail/mark/scan_scratch.hpp>
#include <orbis/octree/integration.hpp>
#include <orbis/octree/occupancy_octree.hpp>
#include <orbis/octree/scan.hpp>

namespace orbis::octree {

/// Limits of one call to replay. When a limit is reached, the remaining octants stay stale until the next call.
struct replay_limits {
  std::chrono::nanoseconds time = std::chrono::nanoseconds::max();  ///< checked after every few dozen bricks
  std::size_t bricks = std::numeric_limits<std::size_t>::max();
};

/// An octree with any sensor model.
template <class M>
concept replayable_octree = octree_map<M> && std::same_as<M, occupancy_octree<typename M::model>>;

/// A map and the scans from which it is built, ordered by the frame index that the caller assigns to each scan.
///
/// @code
///   orbis::octree::scan_history<> history{0.05};
///   history.set(seq, frame, depth, camera, T_world_camera, {.max_range = 5.0});   // applied immediately
///   ...
///   history.set(seq, frame, depth, camera, T_corrected, {.max_range = 5.0});      // after a loop
///   history.replay(par);                                                          // updates the map
///   const auto snapshot = history.map();                                          // for readers on other threads
/// @endcode
///
/// A scan that is newer than all others is applied immediately. Other changes make octants stale; they keep their
/// values until `replay` updates them. When no octant is stale, the map is bit-identical to the one that `integrate`
/// builds from all scans in the order of their frames, independent of the history of calls, limits and policies.
///
/// Not thread-safe, but other threads may read a copy of the map at the same time.
template <replayable_octree Octree = occupancy_octree<>>
class scan_history {
 public:
  using octree_type = Octree;
  using model = typename Octree::model;

  /// Creates an empty map. `resolution`: edge of a voxel, metres. `tree_depth`: the map is 2^tree_depth voxels wide.
  /// @pre same as for the constructor of occupancy_octree
  explicit scan_history(double resolution, int tree_depth = default_tree_depth) : map_{resolution, tree_depth} {
    map_.track_changes();
  }
  scan_history(scan_history&&) noexcept = default;
  scan_history& operator=(scan_history&&) noexcept = default;
  scan_history(const scan_history&) = delete;
  scan_history& operator=(const scan_history&) = delete;
  ~scan_history() = default;

  // -- the map

  /// Returns the current map. A copy shares its memory until the map changes.
  [[nodiscard]] const Octree& map() const noexcept { return map_; }
  [[nodiscard]] const voxel_grid& grid() const noexcept { return map_.grid(); }
  /// Log of changed voxels. A `set` or `replay` that changes the map is one revision, and records exactly the voxels
  /// whose value changed or that became known or unknown.
  [[nodiscard]] const change_log& changes() const noexcept { return map_.changes(); }
  /// Mutable access to the log, to discard revisions that all readers have processed, or to limit its length.
  [[nodiscard]] change_log& changes() noexcept { return map_.changes(); }

  // -- the scans

  /// Sets the scan of `frame` to this depth image, seen from `T_world_camera`, see occupancy_octree::integrate.
  /// Replaces an existing scan, for example after a pose correction or when a later filter invalidates pixels (sets
  /// them to 0). The summary equals that of `integrate`, with all free voxels counted. O(marking, see scan_marker) +
  /// O(bricks observed before and now).
  /// @pre depth and camera have the same size
  template <execution_policy Policy, camera::depth_source Depth, camera::camera_model Camera>
  integration_summary set(const Policy& policy, std::uint64_t frame, const Depth& depth, const Camera& camera,
                          const se3& T_world_camera, const integration_options& options = {}) {
    const integration_summary summary = marker_.mark(policy, grid(), depth, camera, T_world_camera, options, marked_);
    set(frame, marked_);
    return summary;
  }
  /// Sets the scan of `frame` to points in the world frame (metres), seen from `origin`.
  template <execution_policy Policy, point_range Points, point_like Origin>
  integration_summary set(const Policy& policy, std::uint64_t frame, const Points& points, const Origin& origin,
                          const integration_options& options = {}) {
    const integration_summary summary = marker_.mark(policy, grid(), points, origin, options, marked_);
    set(frame, marked_);
    return summary;
  }
  /// Sets the scan of `frame` to voxels that were marked earlier, for example on another thread. O(b log s) for b
  /// bricks observed before or now and s scans that use a brick.
  /// @pre `voxels` were marked for this grid
  void set(std::uint64_t frame, const scan& voxels);
  /// Removes a scan; the octants that it observed become stale. Returns true if it existed. O(its bricks + scans).
  bool remove(std::uint64_t frame);
  /// Returns the voxels of a scan, valid until the scan changes; null if it does not exist. O(log scans).
  [[nodiscard]] const scan* find_scan(std::uint64_t frame) const noexcept;
  [[nodiscard]] bool contains(std::uint64_t frame) const noexcept { return find_scan(frame) != nullptr; }
  /// Number of scans.
  [[nodiscard]] std::size_t size() const noexcept { return order_.size(); }

  // -- replay

  /// Number of bricks with stale octants.
  [[nodiscard]] std::size_t stale_bricks() const noexcept { return uses_.stale().size(); }
  /// Replays stale octants, those stale for longest first, as one revision of the change log. Returns the number of
  /// bricks replayed: at least one, regardless of the time limit, if any is stale and `limits.bricks` is not 0. The map
  /// is the same under every policy. Allocates nothing once its buffers have grown. O(bricks x scans that use each).
  template <execution_policy Policy>
  std::size_t replay(const Policy& policy, const replay_limits& limits = {}) {
    return replay_stale(detail::as_parallel(policy), limits);
  }

  /// Heap memory in bytes of the scans and the per-brick lists of scans, excluding the map. O(bricks + scans).
  [[nodiscard]] std::size_t bytes() const noexcept;
  /// Memory in bytes of the buffers for marking and replaying.
  [[nodiscard]] std::size_t buffer_bytes() const noexcept {
    return marker_.bytes() + marked_.bytes() + replayed_.capacity() * sizeof(replayed_[0]);
  }

 private:
  using value_type = typename Octree::value_type;
  static constexpr std::size_t batch = 64;  ///< number of bricks per thread that are replayed before they are stored

  struct entry {
    std::uint64_t frame = 0;
    scan voxels;
  };
  struct place {
    std::uint64_t frame;
    std::uint32_t number;
  };

  [[nodiscard]] static bool is_before(const place& p, std::uint64_t frame) noexcept { return p.frame < frame; }
  [[nodiscard]] typename std::vector<place>::iterator find(std::uint64_t frame) noexcept;
  /// Returns the index of the scan of `frame`; creates the scan if needed.
  [[nodiscard]] std::uint32_t make_scan(std::uint64_t frame);
  /// Position (existing or for insertion) of the scan of `frame` among the scans that use a brick.
  [[nodiscard]] std::vector<detail::brick_use>::iterator find_place(std::vector<detail::brick_use>& uses,
                                                                    std::uint64_t frame) const noexcept;
  /// Updates the bricks' lists of scans before the voxels of scan `number` are replaced by `after`. If the scan is new
  /// in a brick and newer than the brick's other scans, apply_fresh handles the brick; otherwise octants become stale.
  void change_uses(std::uint32_t number, const scan& after);
  /// Applies the parts of a scan that are in fresh_.
  void apply_fresh(std::uint32_t number);
  std::size_t replay_stale(const parallel_policy& policy, const replay_limits& limits);
  /// Replays the first `count` stale bricks.
  void replay_first(const parallel_policy& policy, detail::brick_store<value_type>& store, change_log* log,
                    std::size_t count);
  Octree map_;
  std::vector<entry> scans_;         ///< indexed by scan
  std::vector<std::uint32_t> free_;  ///< unused scan indices
  std::vector<place> order_;         ///< sorted by frame
  detail::brick_uses uses_;

  scan_marker marker_;
  scan marked_;
  std::vector<std::uint32_t> fresh_;  ///< parts of the current scan that are new, and the newest in their bricks
  std::vector<detail::replayed_brick<value_type>> replayed_;
  std::vector<std::uint64_t> unknown_;  ///< bricks whose voxels have all become unknown
};

}  // namespace orbis::octree

#ifndef ORBIS_COMPILED
#include <orbis/octree/scan_history-inl.hpp>
#endif

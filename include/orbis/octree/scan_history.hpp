// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A map that follows its scans: when a scan changes, is removed, or comes late, the map becomes, bit for bit, the one
/// made of all scans in order.
///
/// Log-odds are clamped, so that the order of scans matters and a scan cannot be subtracted again: what clamping lost
/// would stay lost. Instead, the history keeps what each scan says, as the voxels that it observed free and occupied,
/// and replays the octants of 4x4x4 voxels about which a scan now says something else: from empty, with all scans in
/// order. Replaying is cheap, because no ray is traversed again.
#pragma once

#include <algorithm>
#include <chrono>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/octree/change_log.hpp>
#include <orbis/octree/detail/history/brick_uses.hpp>
#include <orbis/octree/detail/history/replay_brick.hpp>
#include <orbis/octree/detail/storage/apply_scan.hpp>
#include <orbis/octree/integration.hpp>
#include <orbis/octree/occupancy_octree.hpp>
#include <orbis/octree/scan_voxels.hpp>

namespace orbis::octree {

/// How much to replay in one call. Where a limit is reached, the rest stays stale for the next call.
struct replay_limits {
  std::chrono::nanoseconds time = std::chrono::nanoseconds::max();  ///< looked at after every few dozen bricks
  std::size_t bricks = std::numeric_limits<std::size_t>::max();
};

/// An octree with any sensor model.
template <class M>
concept replayable_octree = octree_map<M> && std::same_as<M, occupancy_octree<typename M::model>>;

/// A map, and the scans it is made of, ordered by a number that the caller gives: the index of the frame.
///
/// @code
///   orbis::octree::scan_history<> history{0.05};
///   history.set(seq, frame, depth, camera, T_world_camera, {.max_range = 5.0});   // in the map at once
///   ...
///   history.set(seq, frame, depth, camera, T_corrected, {.max_range = 5.0});      // after a loop
///   history.replay(par);                                                          // the map is right again
///   const auto snapshot = history.map();                                          // for readers on other threads
/// @endcode
///
/// A scan that is newer than all others is applied at once. What else changes makes octants stale; they keep what they
/// held until `replay` has seen to them. When nothing is stale, the map is the one that `integrate` makes of all scans
/// in the order of their frames, bit for bit, whatever the history of calls, limits and policies.
///
/// One thread at a time; a copy of the map may be read by others meanwhile.
template <replayable_octree Octree = occupancy_octree<>>
class scan_history {
 public:
  using octree_type = Octree;
  using model = typename Octree::model;

  /// `resolution`: the edge of a voxel, metres. `tree_depth`: the map is 2^tree_depth voxels wide.
  /// @pre as for occupancy_octree
  explicit scan_history(double resolution, int tree_depth = default_tree_depth) : map_{resolution, tree_depth} {
    map_.track_changes();
  }
  scan_history(scan_history&&) noexcept = default;
  scan_history& operator=(scan_history&&) noexcept = default;
  scan_history(const scan_history&) = delete;
  scan_history& operator=(const scan_history&) = delete;
  ~scan_history() = default;

  // -- the map

  /// The map as it is, readable at any time. A copy shares its memory until the map changes.
  [[nodiscard]] const Octree& map() const noexcept { return map_; }
  [[nodiscard]] const voxel_grid& grid() const noexcept { return map_.grid(); }
  /// Which voxels changed: a `set` or `replay` that changes the map is one revision, and records exactly the voxels
  /// whose value it changed or made known or unknown.
  [[nodiscard]] const change_log& changes() const noexcept { return map_.changes(); }
  /// The log for writing: to forget revisions that all readers have seen, or to limit its length.
  [[nodiscard]] change_log& changes() noexcept { return map_.changes(); }

  // -- the scans

  /// The scan of `frame` is this depth image, seen from `T_world_camera`, see occupancy_octree::integrate. Where there
  /// is one already, this one takes its place: corrected poses and later verdicts of filters (pixels set to 0) come in
  /// this way. The summary is that of `integrate`, with all free voxels counted.
  /// O(marking, see scan_marker) + O(bricks observed before and now).
  /// @pre depth and camera have the same size; options.beam_ranges is empty
  template <execution_policy Policy, camera::depth_source Depth, camera::camera_model Camera>
  integration_summary set(const Policy& policy, std::uint64_t frame, const Depth& depth, const Camera& camera,
                          const se3& T_world_camera, const integration_options& options = {}) {
    const integration_summary summary = marker_.mark(policy, grid(), depth, camera, T_world_camera, options, marked_);
    set(frame, marked_);
    return summary;
  }
  /// The same for points in the world frame (metres), seen from `origin`.
  template <execution_policy Policy, point_range Points, point_like Origin>
  integration_summary set(const Policy& policy, std::uint64_t frame, const Points& points, const Origin& origin,
                          const integration_options& options = {}) {
    const integration_summary summary = marker_.mark(policy, grid(), points, origin, options, marked_);
    set(frame, marked_);
    return summary;
  }
  /// The same for voxels that were marked before, on another thread for example.
  /// O(bricks observed before and now x log(scans that use a brick)).
  /// @pre `voxels` were marked for this grid
  void set(std::uint64_t frame, const scan_voxels& voxels) {
    const std::uint32_t number = make_scan(frame);
    change_uses(number, voxels);
    scans_[number].voxels = voxels;
    apply_fresh(number);
  }
  /// Removes a scan; the octants it observed become stale. Returns whether there was one. O(its bricks + scans).
  bool remove(std::uint64_t frame) {
    const auto at = find(frame);
    if (at == order_.end() || at->frame != frame) return false;
    const std::uint32_t number = at->number;
    change_uses(number, {});
    scans_[number] = {};
    order_.erase(at);
    free_.push_back(number);
    return true;
  }
  /// The voxels of a scan, valid until it changes; null if there is none. O(log scans).
  [[nodiscard]] const scan_voxels* find_scan(std::uint64_t frame) const noexcept {
    const auto at = std::lower_bound(order_.begin(), order_.end(), frame, is_before);
    return at == order_.end() || at->frame != frame ? nullptr : &scans_[at->number].voxels;
  }
  [[nodiscard]] bool contains(std::uint64_t frame) const noexcept { return find_scan(frame) != nullptr; }
  /// How many scans there are.
  [[nodiscard]] std::size_t size() const noexcept { return order_.size(); }

  // -- following them

  /// How many bricks have stale octants.
  [[nodiscard]] std::size_t stale_bricks() const noexcept { return uses_.stale().size(); }
  /// Replays stale octants, those first that have been stale for longest, as one revision of the change log. Returns
  /// the number of bricks replayed: at least one, if there is one, whatever the time. The map is the same under every
  /// policy. Allocates nothing once its buffers have grown. O(bricks x scans that use each).
  template <execution_policy Policy>
  std::size_t replay(const Policy& policy, const replay_limits& limits = {}) {
    if (stale_bricks() == 0 || limits.bricks == 0) return 0;
    const auto start = std::chrono::steady_clock::now();
    const std::size_t wanted = std::min(limits.bricks, stale_bricks());
    std::size_t done = 0;
    map_.change_store([&](auto& store, change_log* log) {
      do {
        const std::size_t count = std::min(wanted - done, batch * std::max(1U, policy.threads()));
        replay_first(policy, store, log, count);
        done += count;
      } while (done != wanted && std::chrono::steady_clock::now() - start < limits.time);
    });
    return done;
  }

  /// Bytes on the heap of the scans and the lists of who observes what; without the map. O(bricks + scans).
  [[nodiscard]] std::size_t bytes() const noexcept {
    std::size_t n = uses_.bytes() + scans_.capacity() * sizeof(scan) + order_.capacity() * sizeof(place) +
                    (free_.capacity() + fresh_.capacity()) * sizeof(std::uint32_t);
    for (const scan& s : scans_) n += s.voxels.bytes();
    return n;
  }
  /// Bytes of the buffers for marking and replaying.
  [[nodiscard]] std::size_t buffer_bytes() const noexcept {
    return marker_.bytes() + marked_.bytes() + replayed_.capacity() * sizeof(replayed_[0]);
  }

 private:
  using value_type = typename Octree::value_type;
  static constexpr std::size_t batch = 64;  ///< bricks that one thread replays before they are stored

  struct scan {
    std::uint64_t frame = 0;
    scan_voxels voxels;
  };
  struct place {
    std::uint64_t frame;
    std::uint32_t number;
  };

  [[nodiscard]] static bool is_before(const place& p, std::uint64_t frame) noexcept { return p.frame < frame; }
  [[nodiscard]] auto find(std::uint64_t frame) noexcept {
    if (order_.empty() || order_.back().frame < frame) return order_.end();
    return std::lower_bound(order_.begin(), order_.end(), frame, is_before);
  }
  /// The number of the scan of `frame`, new or not.
  [[nodiscard]] std::uint32_t make_scan(std::uint64_t frame) {
    const auto at = find(frame);
    if (at != order_.end() && at->frame == frame) return at->number;
    std::uint32_t number = 0;
    if (free_.empty()) {
      number = static_cast<std::uint32_t>(scans_.size());
      scans_.emplace_back();
    } else {
      number = free_.back();
      free_.pop_back();
    }
    scans_[number].frame = frame;
    order_.insert(at, {frame, number});
    return number;
  }

  /// Where the scan of `frame` stands, or would stand, among those that use a brick.
  [[nodiscard]] auto place_of(std::vector<detail::brick_use>& uses, std::uint64_t frame) const noexcept {
    if (uses.empty() || scans_[uses.back().scan].frame < frame) return uses.end();
    return std::lower_bound(uses.begin(), uses.end(), frame,
                            [&](const detail::brick_use& u, std::uint64_t f) { return scans_[u.scan].frame < f; });
  }
  [[nodiscard]] static unsigned octants_of(const scan_voxels::part& p) noexcept { return p.free | p.occupied | p.full; }
  /// The octants of a brick of which two scans say different things.
  [[nodiscard]] static unsigned different_octants(const scan_voxels& a, const scan_voxels::part& in_a,
                                                  const scan_voxels& b, const scan_voxels::part& in_b) noexcept {
    const auto x = a.masks(in_a), y = b.masks(in_b);
    unsigned different = 0;
    for (unsigned i = 0; i != 8; ++i)
      if (((x.free[i] ^ y.free[i]) | (x.occupied[i] ^ y.occupied[i])) != 0) different |= 1U << i;
    return different;
  }
  /// Brings the lists of the bricks' users from what scan `number` says to what `after` says. Where the scan is the
  /// newest of a brick, the brick is left to apply_fresh; elsewhere octants become stale.
  void change_uses(std::uint32_t number, const scan_voxels& after) {
    const scan& s = scans_[number];
    const auto old_parts = s.voxels.parts(), new_parts = after.parts();
    std::size_t i = 0;
    const auto drop = [&](const scan_voxels::part& p) {
      const std::uint32_t brick = uses_.number_of(p.name);
      auto& uses = uses_[brick].uses;
      uses.erase(place_of(uses, s.frame));
      uses_.make_stale(brick, octants_of(p));
    };
    fresh_.clear();
    for (std::uint32_t j = 0; j != new_parts.size(); ++j) {
      const scan_voxels::part& p = new_parts[j];
      for (; i != old_parts.size() && old_parts[i].name < p.name; ++i) drop(old_parts[i]);
      const std::uint32_t brick = uses_.number_of(p.name);
      auto& uses = uses_[brick].uses;
      const auto at = place_of(uses, s.frame);
      if (i != old_parts.size() && old_parts[i].name == p.name) {
        at->part = j;
        uses_.make_stale(brick, different_octants(s.voxels, old_parts[i], after, p));
        ++i;
      } else if (at == uses.end()) {
        uses.push_back({number, j});
        fresh_.push_back(j);
      } else {
        uses.insert(at, {number, j});
        uses_.make_stale(brick, octants_of(p));
      }
    }
    for (; i != old_parts.size(); ++i) drop(old_parts[i]);
  }
  /// Applies the parts of a scan that are the newest in their bricks.
  void apply_fresh(std::uint32_t number) {
    if (fresh_.empty()) return;
    const scan_voxels& voxels = scans_[number].voxels;
    map_.change_store([&](auto& store, change_log* log) {
      for (const std::uint32_t i : fresh_) {
        const scan_voxels::part& p = voxels.parts()[i];
        const voxel_key key = detail::named_key(p.name);
        auto& b = store.make(key);
        voxels.for_each_octant(p, [&](unsigned octant, std::uint64_t free, std::uint64_t occupied) {
          const std::uint64_t changed = detail::apply_octant<model>(store, b, octant, occupied, free).changed;
          if (log != nullptr) log->record(child_key(key, octant, node_cells(detail::octant_level)), changed);
        });
      }
    });
  }
  /// Replays the first `count` stale bricks.
  template <class Policy>
  void replay_first(const Policy& policy, detail::brick_store<value_type>& store, change_log* log, std::size_t count) {
    if (replayed_.size() < count) replayed_.resize(count);
    const auto stale = uses_.stale().first(count);
    const auto voxels_of = [&](std::uint32_t number) -> const scan_voxels& { return scans_[number].voxels; };
    for_each_index(policy, count, 4, [&](std::size_t i) {
      detail::replay_brick<model>(store, uses_[stale[i]], voxels_of, replayed_[i]);
    });
    unknown_.clear();
    for (std::size_t i = 0; i != count; ++i) {
      const std::uint64_t name = uses_[stale[i]].name;
      if (!detail::store_replayed(store, name, replayed_[i], log)) unknown_.push_back(name);
    }
    store.erase_bricks(unknown_);
    uses_.finish(count);
  }

  Octree map_;
  std::vector<scan> scans_;          ///< by number
  std::vector<std::uint32_t> free_;  ///< numbers that are not in use
  std::vector<place> order_;         ///< by frame
  detail::brick_uses uses_;

  scan_marker marker_;
  scan_voxels marked_;
  std::vector<std::uint32_t> fresh_;  ///< parts of the scan at hand that are the newest in their bricks
  std::vector<detail::replayed_brick<value_type>> replayed_;
  std::vector<std::uint64_t> unknown_;  ///< bricks of which nothing is known any more
};

}  // namespace orbis::octree

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The occupancy map: a log-odds octree. Its values are bit-identical to those of OctoMap for the same scans.
///
/// A. Hornung, K. M. Wurm, M. Bennewitz, C. Stachniss, W. Burgard, "OctoMap: An efficient
/// probabilistic 3D mapping framework based on octrees", Autonomous Robots 34, 2013.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <ranges>
#include <type_traits>
#include <utility>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/octree/accessor.hpp>
#include <orbis/octree/cast_ray.hpp>
#include <orbis/octree/change_log.hpp>
#include <orbis/octree/detail/mark/depth/depth_scan.hpp>
#include <orbis/octree/detail/mark/rays/ray_traversal.hpp>
#include <orbis/octree/detail/mark/scan_scratch.hpp>
#include <orbis/octree/detail/storage/brick.hpp>
#include <orbis/octree/detail/storage/large_leaves.hpp>
#include <orbis/octree/detail/storage/leaves.hpp>
#include <orbis/octree/detail/storage/tree_parts.hpp>
#include <orbis/octree/integration.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::octree {

/// Unpacked voxels of an octant (an aligned node of 4x4x4 voxels), see occupancy_octree::edit_octant: `value[i]` is the
/// stored value of voxel i, in Morton order (morton_code(key) & 63); bit i of `known` is set if the voxel is known.
using detail::block;

class scan;  // scan.hpp

/// A leaf of the pruned octree: a cube of voxels with equal log-odds.
template <class T>
struct octree_leaf {
  voxel_key key;    ///< lowest voxel of the leaf
  int depth = 0;    ///< depth of the leaf in the tree; tree_depth() for a single voxel
  vec3 center;      ///< metres
  double size = 0;  ///< edge, metres
  T log_odds{};
  bool occupied = false;
};

/// A map of free, occupied and unknown space in cubic voxels of one size. The grid has 2^tree_depth voxels along
/// each axis (65536 by default) and is centred at the world's origin. Coordinates are metres in the world frame.
///
/// @code
///   orbis::octree::occupancy_octree<> map{0.05};
///   map.integrate(points_world, sensor_origin, {.max_range = 5.0});
///   if (map.state(p) == orbis::octree::occupancy::occupied) ...
/// @endcode
///
/// Const members can be called from several threads concurrently. A copy shares all memory with the original (copy on
/// write) and takes O(pages of 4 KB): readers on other threads take a copy between two insertions and use it while the
/// writer continues.
template <sensor_model Model = log_odds<>>
class occupancy_octree {
 public:
  using model = Model;
  using value_type = typename Model::value_type;  ///< type of a stored value (log-odds)
  using leaf = octree_leaf<value_type>;

  /// Creates an empty map. `resolution`: edge of a voxel, metres. `tree_depth`: the map is 2^tree_depth voxels wide.
  /// @pre resolution finite and > 0; 5 <= tree_depth <= max_tree_depth
  explicit occupancy_octree(double resolution, int tree_depth = default_tree_depth);
  /// Creates a map from bricks, for the library's own readers. @pre no brick is outside the grid
  occupancy_octree(double resolution, int tree_depth, detail::brick_store<value_type> store);
  occupancy_octree(const occupancy_octree&);
  occupancy_octree(occupancy_octree&&) noexcept;
  occupancy_octree& operator=(const occupancy_octree&);
  occupancy_octree& operator=(occupancy_octree&&) noexcept;
  ~occupancy_octree();

  [[nodiscard]] double resolution() const noexcept { return grid_.resolution(); }
  [[nodiscard]] int tree_depth() const noexcept { return grid_.depth(); }
  [[nodiscard]] const voxel_grid& grid() const noexcept { return grid_; }
  /// Returns the storage, for the library's own algorithms. The type is internal and may change.
  [[nodiscard]] const detail::brick_store<value_type>& store() const noexcept { return store_; }

  // -- insertion

  /// Integrates a scan: `points` in the world frame (metres), seen from `origin`. Every voxel crossed by rays is
  /// observed as free once, and every voxel that contains points is observed as occupied once, regardless of the
  /// numbers of rays and points; a voxel to which both apply is observed as occupied. Coordinates are first rounded to
  /// float. The result does not depend on the policy or on the order of the points. Points that are non-finite or
  /// outside the grid are counted as rejected; if the origin is non-finite, all points are. In mode every_ray, a scan
  /// with many points per voxel, such as one from a depth image, takes little more time than the image: O(points +
  /// voxels near surfaces). Other scans take O(points x voxels per ray).
  template <execution_policy Policy, point_range Points, point_like Origin>
  integration_summary integrate(const Policy& policy, const Points& points, const Origin& origin,
                                const integration_options& options = {}) {
    return integrate_points(detail::as_parallel(policy), scratch_.view(points), coordinates<float>(origin), options);
  }
  template <point_range Points, point_like Origin>
  integration_summary integrate(const Points& points, const Origin& origin, const integration_options& options = {}) {
    return integrate(seq, points, origin, options);
  }
  /// Integrates a depth image (depths in metres along the optical axis). The result equals that of integrating the
  /// image's world points (see append_world_points), seen from the camera's centre, but is computed many times faster.
  /// O(pixels + voxels near surfaces).
  /// @pre depth and camera have the same size
  template <execution_policy Policy, camera::depth_source Depth, camera::camera_model Camera>
  integration_summary integrate(const Policy& policy, const Depth& depth, const Camera& camera,
                                const se3& T_world_camera, const integration_options& options = {}) {
    return integrate_depth(detail::as_parallel(policy), detail::depth_scan{depth, camera}, T_world_camera, options);
  }
  template <camera::depth_source Depth, camera::camera_model Camera>
  integration_summary integrate(const Depth& depth, const Camera& camera, const se3& T_world_camera,
                                const integration_options& options = {}) {
    return integrate(seq, depth, camera, T_world_camera, options);
  }

  /// Applies the voxels of a scan that was marked before, for example on another thread (see scan_marker); `integrate`
  /// marks and applies in one call. Returns the numbers of voxels observed as free and as occupied. O(bricks
  /// observed).
  /// @pre the scan was marked for this grid
  integration_summary apply(const scan& voxels);

  /// Calls `change(store, log)` with the storage, as one revision of the change log, for the library's own algorithms:
  /// the type of the store is internal and may change. `change` must record every voxel that it changes in `log`; `log`
  /// is null if changes are not tracked.
  template <std::invocable<detail::brick_store<value_type>&, change_log*> Change>
  void change_store(Change&& change) {
    begin_change();
    change(store_, track_.on ? &track_.log : nullptr);
  }

  /// Sets all voxels of a node to one value. `key`: the node's lowest voxel; `depth`: depth of the node in the tree (0:
  /// the root, tree_depth(): one voxel). O(1).
  /// @pre all voxels of the node are unknown; key is a multiple of the node's size
  void set_unknown_node(const voxel_key& key, int depth, value_type value) {
    begin_change();
    store_.set_node(key, tree_depth() - depth, without_sign_of_zero(value));
    note_node(key, tree_depth() - depth);
  }

  /// Makes all voxels unknown and frees the memory. Keeps the grid.
  void clear() {
    store_.clear();
    scratch_ = {};
    lose_track();
  }

  // -- modification of known voxels

  /// Calls `edit(block&)` with the 64 voxels of the octant that contains `k`, and stores the result. Ignores values of
  /// voxels that are unknown after the call. O(1). @pre k is in the grid
  template <std::invocable<block<value_type>&> Edit>
  void edit_octant(const voxel_key& k, Edit&& edit) {
    edit_octants(std::array{k}, [&](const voxel_key&, block<value_type>& voxels) { edit(voxels); });
  }
  /// Calls `edit(key, block&)` for each of `keys` in turn, as edit_octant does; all changes belong to one revision of
  /// the change log. O(keys).
  template <std::ranges::input_range Keys, std::invocable<const voxel_key&, block<value_type>&> Edit>
  void edit_octants(const Keys& keys, Edit&& edit) {
    begin_change();
    for (const voxel_key& k : keys) {
      assert(std::max({k.x, k.y, k.z}) < grid_.cells());
      block<value_type> before;
      if (const detail::brick<value_type>* const b = store_.find(k)) {
        store_.read_octant(*b, detail::place_in_brick(k) >> 6U, before);
      } else if (const value_type* const large = store_.find_large_value(k)) {
        before.value.fill(*large);
        before.known = ~std::uint64_t{0};
      }
      block<value_type> after = before;
      edit(k, after);
      replace_octant(k, before, after);
    }
  }
  /// Replaces every voxel's value by `change(value)`, a std::optional; empty makes the voxel unknown. `change` must
  /// depend only on its argument, as decay policies do (decay.hpp): one call may serve all voxels of an octant that
  /// have the same value. O(octants).
  template <class Change>
  requires std::is_invocable_r_v<std::optional<value_type>, Change&, value_type> void transform(Change&& change) {
    begin_change();
    const bool has_large = store_.has_large();
    const auto changed = [&](value_type v) -> std::optional<value_type> {
      const std::optional<value_type> after = change(v);
      return after ? std::optional{without_sign_of_zero(*after)} : after;
    };
    store_.transform(changed, [&](std::uint64_t name, std::uint32_t octant, std::uint64_t mask) {
      if (track_.on)
        track_.log.record(child_key(detail::named_key(name), octant, node_cells(detail::octant_level)), mask);
    });
    if (has_large) lose_track();
  }
  /// Rolling window: removes every brick (8x8x8 voxels) and larger leaf that is completely outside `box` (metres),
  /// after calling `evict(const leaf&)` for its leaves. `set_unknown_node(leaf.key, leaf.depth, leaf.log_odds)`
  /// restores a leaf. Returns the number of bricks and larger leaves removed. The change log records the evicted
  /// voxels, which are now unknown. Payload layers keep their values; erase the evicted voxels from them. O(bricks +
  /// voxels evicted).
  template <std::invocable<const leaf&> Evict>
  std::size_t evict_outside(const bounding_box& box, Evict&& evict) {
    const auto is_outside = [&](std::uint64_t name) {
      const bounding_box cube = node_cube(grid_, detail::named_key(name), detail::named_level(name));
      return any_greater(cube.min, box.max) || any_greater(box.min, cube.max);
    };
    std::vector<std::uint64_t> bricks, large;
    std::vector<detail::tree_part<value_type>> parts = detail::stored_parts(store_);
    std::erase_if(parts, [&](const auto& part) { return !is_outside(detail::node_name(part.key, part.level)); });
    for (const auto& part : parts)
      (part.level == detail::brick_level ? bricks : large).push_back(detail::node_name(part.key, part.level));
    if (parts.empty()) return 0;
    begin_change();
    for (const auto& part : parts) note_brick(part.key, part.level);
    detail::merge_parts(parts, tree_depth());
    detail::visit_parts(store_, parts, tree_depth(),
                        [&](const voxel_key& key, int level, value_type v) { evict(make_leaf(key, level, v)); });
    store_.erase_bricks(bricks);
    store_.erase_large(large);
    return bricks.size() + large.size();
  }
  /// Merges equal uniform bricks into larger leaves. This saves memory and changes no value. Within bricks, pruning is
  /// always immediate. A later change splits a leaf again. O(bricks).
  void prune();

  /// Starts recording changed voxels (see change_log), or stops and clears the log. After `clear`, an assignment, a
  /// change to a leaf larger than a brick, or a period without tracking, the log is incomplete: its `complete_since`
  /// advances, and readers must read the whole map again. While tracking is stopped, `complete_since` exceeds
  /// `revision`, so readers must read the whole map every time. Copies are not tracked.
  void track_changes(bool wanted = true) {
    if (track_.on == wanted) return;
    track_.on = wanted;
    if (!store_.empty() || track_.log.revision() != 0) lose_track();
  }
  /// Returns true if changes are recorded. The log of a map that was never tracked has `revision` 0.
  [[nodiscard]] bool tracks_changes() const noexcept { return track_.on; }
  [[nodiscard]] const change_log& changes() const noexcept { return track_.log; }
  /// Mutable access to the log, to discard revisions that all readers have processed, or to limit its length.
  [[nodiscard]] change_log& changes() noexcept { return track_.log; }

  // -- queries

  /// Returns the value stored at `p` (metres), empty if unknown or outside the grid. O(1), like the single-voxel
  /// queries below.
  template <point_like P>
  [[nodiscard]] std::optional<value_type> value(const P& p) const {
    const auto key = grid_.key(p);
    return key ? store_.value(*key) : std::nullopt;
  }
  [[nodiscard]] std::optional<value_type> value(const voxel_key& key) const { return store_.value(key); }
  /// Returns the log-odds at `p`, empty if unknown or outside the grid.
  template <class P>
  requires point_like<P> || std::same_as<P, voxel_key>
  [[nodiscard]] std::optional<value_type> log_odds(const P& p) const { return value(p); }
  /// Returns the probability that `p` is occupied, empty if unknown or outside the grid.
  template <class P>
  requires point_like<P> || std::same_as<P, voxel_key>
  [[nodiscard]] std::optional<double> probability(const P& p) const { return probability_at<Model>(value(p)); }
  /// Returns an accessor, which answers single-voxel queries several times faster for positions near each other. Use
  /// one per thread; valid until the map changes.
  [[nodiscard]] octree_accessor<Model> accessor() const noexcept { return {store_, grid_}; }
  /// Returns the state of `p`.
  template <class P>
  requires point_like<P> || std::same_as<P, voxel_key>
  [[nodiscard]] occupancy state(const P& p) const {
    const auto v = value(p);
    if (!v) return occupancy::unknown;
    return is_occupied<Model>(*v) ? occupancy::occupied : occupancy::free;
  }

  /// Finds the first voxel along a ray that is occupied, or unknown unless `ignore_unknown`. `origin` in metres,
  /// `direction` of any length, `max_range` in metres (infinite or <= 0: no limit). The voxel is the same as that of
  /// OctoMap's `castRay`. See ray_hit, and cast_rays for many rays. O(voxels along the ray).
  template <point_like Origin, point_like Direction>
  [[nodiscard]] ray_hit cast_ray(const Origin& origin, const Direction& direction,
                                 double max_range = std::numeric_limits<double>::infinity(),
                                 bool ignore_unknown = false) const {
    ray_caster<Model> cast{store_, grid_, {.max_range = max_range, .ignore_unknown = ignore_unknown}};
    return cast(coordinates<float>(origin), coordinates<float>(direction));
  }

  /// Calls `visit(const leaf&)` for every leaf of the pruned octree, in Morton order. O(known voxels).
  template <std::invocable<const leaf&> Visit>
  void for_each_leaf(Visit&& visit) const {
    detail::visit_leaves(store_, tree_depth(),
                         [&](const voxel_key& key, int level, value_type v) { visit(make_leaf(key, level, v)); });
  }
  /// Counts the nodes of the pruned octree. O(bricks + octants that are not uniform), like the four functions below.
  [[nodiscard]] octree_counts counts() const;
  /// Number of leaves of the pruned octree, of any size.
  [[nodiscard]] std::size_t num_leaves() const { return counts().leaves; }
  [[nodiscard]] std::size_t num_occupied_leaves() const { return counts().occupied_leaves; }
  [[nodiscard]] std::size_t num_free_leaves() const { return counts().free_leaves; }
  /// Number of nodes of the pruned octree, including inner nodes and leaves.
  [[nodiscard]] std::size_t size() const { return counts().nodes; }
  [[nodiscard]] bool empty() const noexcept { return store_.empty(); }

  /// Smallest box around all known voxels; empty if there are none.
  [[nodiscard]] std::optional<bounding_box> bounds() const;

  /// Heap memory in bytes of the map and its change log, including memory shared with copies, without the scan buffers.
  [[nodiscard]] std::size_t memory_bytes() const noexcept { return store_.memory_bytes() + track_.log.memory_bytes(); }
  /// Heap memory in bytes of the reused scan buffers.
  [[nodiscard]] std::size_t buffer_bytes() const noexcept { return scratch_.memory_bytes(); }

 private:
  /// Parts of `integrate` that are not instantiated for each policy and point type.
  integration_summary integrate_points(const parallel_policy& policy, const detail::point_view& points,
                                       const detail::float3& origin, const integration_options& options);
  integration_summary integrate_depth(const parallel_policy& policy, const detail::depth_scan& scan,
                                      const se3& T_world_camera, const integration_options& options);

  /// The change log. Copies of a map start without one; moving a map moves its log. If a map is assigned to or moved
  /// from, its whole content changes and its own log becomes incomplete: readers hold revisions of this log, and the
  /// revisions of another log would be meaningless to them.
  struct tracking {
    change_log log;
    bool on = false;

    tracking() = default;
    tracking(const tracking&) noexcept {}
    tracking(tracking&& other) noexcept : log{std::move(other.log)}, on{other.on} { other.lose(); }
    tracking& operator=(const tracking&) {
      lose();
      return *this;
    }
    tracking& operator=(tracking&& other) noexcept {
      lose();
      other.lose();
      return *this;
    }
    ~tracking() = default;

    /// Marks the log as incomplete, because the last change is not recorded.
    void lose() {
      if (!on) return log.stop();
      log.begin_revision();
      log.clear();
    }
  };

  [[nodiscard]] leaf make_leaf(const voxel_key& key, int level, value_type v) const {
    return {key, tree_depth() - level, grid_.center(key, level), grid_.node_size(level), v, is_occupied<Model>(v)};
  }
  /// Stores a changed octant, and removes its brick if all its voxels are unknown.
  void replace_octant(const voxel_key& k, const block<value_type>& before, block<value_type>& after);
  /// Replaces -0 by 0, because values are compared bit by bit.
  [[nodiscard]] static constexpr value_type without_sign_of_zero(value_type v) noexcept {
    return v == value_type{} ? value_type{} : v;
  }
  void begin_change() {
    if (track_.on) track_.log.begin_revision();
  }
  void lose_track() { track_.lose(); }
  /// Records that all known voxels of a brick, or of a larger leaf, are about to change.
  void note_brick(const voxel_key& k, int level);
  void note_node(const voxel_key& k, int level);

  voxel_grid grid_;
  detail::brick_store<value_type> store_;
  detail::scan_scratch scratch_;
  tracking track_;
};

}  // namespace orbis::octree

#ifndef ORBIS_COMPILED
#include <orbis/octree/occupancy_octree-inl.hpp>
#endif

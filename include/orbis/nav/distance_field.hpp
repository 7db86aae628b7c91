// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A truncated Euclidean distance field of an occupancy map (distance to the nearest obstacle), updated when the map
/// changes.
///
/// @code
///   map.track_changes();
///   orbis::nav::distance_field field{map, {.reach = 1.0}};
///   ...
///   map.integrate(depth, camera, T_world_camera);
///   field.update(map);                                   // changes since the last update
///   if (field.distance(p) < 0.3) slow_down();
///   const auto [metres, gradient] = field.distance_and_gradient(p);
///   const orbis::nav::distance_view now = field.view();   // for readers on other threads
/// @endcode
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/core/point.hpp>
#include <orbis/core/types.hpp>
#include <orbis/nav/detail/map_follower.hpp>
#include <orbis/nav/map_access.hpp>
#include <orbis/nav/squared_distances.hpp>
#include <orbis/octree/change_log.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::nav {

struct distance_field_options {
  double reach = 1.0;  ///< maximum distance, metres (1 to 181 voxels); larger distances are reported as `reach`
  /// State assumed for unknown voxels: occupied or free.
  octree::occupancy unknown = octree::occupancy::occupied;
  /// Swaps obstacles and free space: the field then contains the depth inside obstacles, and 0 outside them. See
  /// signed_distance.
  bool inside = false;
  /// Maximum number of bricks of 8x8x8 voxels (2.9 kB each) for leaves of the map that are larger than a brick: a file
  /// of a few bytes can describe a leaf as large as the grid. Leaves beyond the limit are omitted, see `is_complete`.
  std::size_t max_bricks = std::size_t{1} << 19U;
};

/// A distance and its gradient, which is dimensionless and has a length of about 1 where a single obstacle is nearest.
struct distance_with_gradient {
  double distance = 0.0;  ///< metres
  vec3 gradient = zeros<vec3>();
};

/// Distances in metres. The distance of a voxel is measured between its centre and the centre of the nearest obstacle
/// voxel; it is 0 in obstacles and at most `reach()`. Space outside the grid counts as unknown.
template <class Voxels>
class metric_distances {
 public:
  /// The distance of the voxel that contains `p` (metres). O(1), about 20 ns.
  template <point_like P>
  [[nodiscard]] double distance(const P& p) const noexcept {
    const auto k = grid_.key(p);
    return k ? distance(*k) : metres(voxels_.elsewhere());
  }
  [[nodiscard]] double distance(const octree::voxel_key& k) const noexcept { return metres(voxels_.squared(k)); }
  /// Interpolates linearly along each axis between the centres of the eight voxels around `p` (metres). The distance is
  /// continuous, and the gradient is its derivative. Beyond the centres of the grid's outermost voxels, space outside
  /// the grid counts as an obstacle if unknown space does; otherwise the outermost values extend to the edge of the
  /// grid, and the distance outside the grid is `reach()`. O(1), about 50 ns.
  template <point_like P>
  [[nodiscard]] distance_with_gradient distance_and_gradient(const P& p) const noexcept {
    const auto c = coordinates<double>(p);
    const double cell = grid_.resolution();
    const bool is_outside_free = voxels_.elsewhere() != 0;
    if (is_outside_free && !grid_.key(p)) return {.distance = reach_};
    std::array<double, 3> part{};
    std::array<std::optional<std::uint32_t>, 3> low, high;
    for (std::size_t i = 0; i != 3; ++i) {
      const double shifted = c[i] - cell / 2;
      low[i] = grid_.key(shifted);
      if (low[i]) {
        part[i] = std::clamp((c[i] - grid_.center(*low[i])) / cell, 0.0, 1.0);
        if (*low[i] + 1 != grid_.cells()) high[i] = *low[i] + 1;
      } else if (grid_.key(shifted + cell)) {
        high[i] = 0;
        part[i] = std::clamp((c[i] - grid_.center(0)) / cell + 1.0, 0.0, 1.0);
      }
      if (is_outside_free && !low[i]) low[i] = high[i];
      if (is_outside_free && !high[i]) high[i] = low[i];
    }
    squared_distance_view::reader reader{voxels_};
    std::array<double, 8> d{};
    for (std::size_t i = 0; i != 8; ++i) {
      const auto& x = (i & 1U) != 0 ? high[0] : low[0];
      const auto& y = (i & 2U) != 0 ? high[1] : low[1];
      const auto& z = (i & 4U) != 0 ? high[2] : low[2];
      d[i] = metres(x && y && z ? reader.squared({*x, *y, *z}) : voxels_.elsewhere());
    }
    const auto mix = [](double a, double b, double t) { return a + t * (b - a); };
    const auto [u, v, w] = part;
    const double x00 = mix(d[0], d[1], u), x10 = mix(d[2], d[3], u), x01 = mix(d[4], d[5], u), x11 = mix(d[6], d[7], u);
    const double y0 = mix(x00, x10, v), y1 = mix(x01, x11, v);
    const double along_x = mix(mix(d[1] - d[0], d[3] - d[2], v), mix(d[5] - d[4], d[7] - d[6], v), w);
    const double along_y = mix(x10 - x00, x11 - x01, w);
    return {mix(y0, y1, w), vec3{along_x, along_y, y1 - y0} / cell};
  }
  /// Radius (metres) of a ball around `p` that certainly contains no point of an obstacle's cube; 0 in obstacles. O(1).
  template <point_like P>
  [[nodiscard]] double clearance(const P& p) const noexcept {
    const auto k = grid_.key(p);
    if (!k) return 0.0;
    const auto c = coordinates<double>(p);
    const double off = norm(vec3{c[0], c[1], c[2]} - grid_.center(*k));
    return std::max(0.0, distance(*k) - off - half_diagonal());
  }
  /// Squared distances in voxels.
  [[nodiscard]] const Voxels& voxels() const noexcept { return voxels_; }
  [[nodiscard]] const octree::voxel_grid& grid() const noexcept { return grid_; }
  /// The largest distance, metres.
  [[nodiscard]] double reach() const noexcept { return reach_; }
  /// Converts a squared distance in voxels to a distance in metres.
  [[nodiscard]] double metres(std::uint16_t squared) const noexcept {
    return squared == squared_distance_view::far
               ? reach_
               : std::min(reach_, std::sqrt(static_cast<double>(squared)) * grid_.resolution());
  }

 protected:
  friend class distance_field;
  metric_distances(octree::voxel_grid grid, Voxels voxels, double reach)
      : grid_{grid}, voxels_{std::move(voxels)}, reach_{reach} {}

  [[nodiscard]] double half_diagonal() const noexcept { return 0.86602540378443865 * grid_.resolution(); }

  octree::voxel_grid grid_;
  Voxels voxels_;
  double reach_;
};

/// An immutable snapshot of the distances, for readers. It shares memory with the field from which it was made.
using distance_view = metric_distances<squared_distance_view>;

/// Signed distance at `p` (metres) and its gradient, from two fields of one map: a normal one, and one with the option
/// `inside`. The distance is positive outside obstacles and negative inside, where the gradient points outwards; it is
/// interpolated in the same way as the two fields, and its range is [-reach, reach]. Between an obstacle voxel and an
/// adjacent free voxel, it changes from minus to plus the edge length of a voxel, and is 0 on the face between them.
/// O(1).
///
/// @code
///   const orbis::nav::distance_field outside{map, {.reach = 1.0}}, inside{map, {.reach = 0.5, .inside = true}};
///   const auto [metres, gradient] = orbis::nav::signed_distance(outside, inside, p);
/// @endcode
template <class Outside, class Inside, point_like P>
[[nodiscard]] distance_with_gradient signed_distance(const metric_distances<Outside>& outside,
                                                     const metric_distances<Inside>& inside, const P& p) noexcept {
  const distance_with_gradient to = outside.distance_and_gradient(p), out = inside.distance_and_gradient(p);
  return {to.distance - out.distance, to.gradient - out.gradient};
}

/// The distance field of a map. It is bitwise identical to a field rebuilt from the current map, regardless of the
/// order of changes, including obstacles that appear and disappear. No bounds need to be specified. The algorithm is
/// described in squared_distances.hpp.
///
/// Not thread-safe. Readers on other threads use a `view()` made on the thread that updates the field.
class distance_field : public metric_distances<squared_distances> {
 public:
  /// The field of an empty map. @pre options.reach is 1 to 181 times the resolution
  explicit distance_field(const octree::voxel_grid& grid, const distance_field_options& options = {})
      : metric_distances{grid,
                         {static_cast<int>(std::ceil(options.reach / grid.resolution() - 1e-9)), grid.cells(),
                          (options.unknown == octree::occupancy::occupied) != options.inside},
                         options.reach},
        options_{options} {}
  /// The field of `map`.
  template <planning_map Map>
  explicit distance_field(const Map& map, const distance_field_options& options = {})
      : distance_field{map_access<Map>::grid(map), options} {
    update(map);
  }

  /// Updates the field from the map's change log (`map.changes()`) if the log covers all changes since the last update.
  /// Otherwise compares the field with the whole map: after changes that the log does not record (see
  /// occupancy_octree::track_changes), and every time if changes are not tracked. Costs as much as
  /// squared_distances::update, plus O(bricks of the field + octants of the map) for the comparison. For a leaf with an
  /// edge of 256 voxels or more, only the part within reach of its faces costs time and memory; if a leaf of this size
  /// has appeared or disappeared since the last comparison, the field is rebuilt. @pre every call passes the same map,
  /// with the same grid
  template <planning_map Map>
  void update(const Map& map) {
    assert(map_access<Map>::grid(map) == grid_);
    follower_.follow(map, changed_in(map), [&] { compare_all(map); });
  }
  /// Updates the field from a copy of the map (a snapshot) and the change log of the original map. `revision`: revision
  /// of the log when the copy was made. The log may be newer than the copy, and the copy may be older than the previous
  /// one; the result is the field of the copy.
  ///
  /// @code
  ///   listeners.published = [&](const auto& snapshot, const octree::change_log& log) {  // of a live_map_thread
  ///     field.update(snapshot.map, log, snapshot.revision);
  ///   };
  /// @endcode
  /// @pre revision <= log.revision(); every call passes a copy of the same map, with the same grid
  template <planning_map Map>
  void update(const Map& copy, const octree::change_log& log, std::uint64_t revision) {
    assert(map_access<Map>::grid(copy) == grid_);
    follower_.follow(log, revision, changed_in(copy), [&] { compare_all(copy); });
  }
  /// Updates the field by comparing it with the whole map, without the log.
  template <planning_map Map>
  void update_all(const Map& map) {
    assert(map_access<Map>::grid(map) == grid_);
    compare_all(map);
    follower_.mark_read(map);
  }

  /// The centre of the obstacle nearest to the voxel that contains `p`, metres; empty if there is none within reach.
  template <point_like P>
  [[nodiscard]] std::optional<vec3> nearest_obstacle(const P& p) const {
    const auto k = grid_.key(p);
    const auto found = k ? voxels_.nearest(*k) : std::nullopt;
    return found ? std::optional{grid_.center(*found)} : std::nullopt;
  }
  /// A view for readers on other threads. Call this on the thread that updates the field, between two updates (for
  /// example, after each one), and pass the view on under a lock or through an atomic shared pointer. The view shares
  /// memory with the field and does not change; several threads may read it concurrently, and it may be copied and
  /// destroyed on any thread. O(bricks): one pointer and one atomic increment per 4 bricks; afterwards, the field
  /// clones the parts that it writes to, 4 kB at a time. On the updating thread, query the field itself.
  [[nodiscard]] distance_view view() const { return {grid_, voxels_.view(), reach_}; }
  /// Returns false if leaves of the map were omitted because of `max_bricks`: they count as unknown, at least where the
  /// field stores nothing. In that case, if unknown space counts as an obstacle, distances may be too short; if it
  /// counts as free, obstacles are missing. With the option `inside`, the reverse holds.
  [[nodiscard]] bool is_complete() const noexcept { return is_complete_; }
  [[nodiscard]] const distance_field_options& options() const noexcept { return options_; }
  /// Heap memory in bytes.
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return voxels_.memory_bytes() + octants_.capacity() * sizeof(octant_obstacles);
  }

 private:
  template <planning_map Map>
  [[nodiscard]] auto changed_in(const Map& map) {
    return [this, &map](const octree::change_log& log, std::uint64_t since) {
      octants_.clear();
      auto octants = map_access<Map>::octants(map);
      log.for_each_since(since, [&](const octree::voxel_key& k, std::uint64_t) {
        octants_.push_back({k, obstacles(octants(k))});
      });
      apply();
    };
  }
  /// Minimum level of leaves that are added to the field as cubes.
  static constexpr int cube_level = 8;

  template <planning_map Map>
  void compare_all(const Map& map) {
    if (!find_differences(map)) {
      voxels_ = {voxels_.reach(), grid_.cells(), voxels_.elsewhere() == 0};
      find_differences(map);
    }
    apply();
  }
  /// Lists the octants in which the field may differ from the map; initialises an empty field with the large leaves of
  /// the map as cubes. Returns false if the cubes that the field was initialised with no longer match the map.
  template <planning_map Map>
  bool find_differences(const Map& map) {
    octants_.clear();
    auto octants = map_access<Map>::octants(map);
    voxels_.for_each_brick([&](const octree::voxel_key& low, auto&&) {
      for (unsigned i = 0; i != 8; ++i) {
        const octree::voxel_key k = octree::child_key(low, i, 4);
        octants_.push_back({k, obstacles(octants(k))});
      }
    });
    const bool is_first = voxels_.brick_count() == 0 && !voxels_.has_cubes();
    if (is_first) cubes_ = {};
    const std::uint64_t elsewhere = obstacles({});
    std::vector<voxel_cube> cubes;
    std::uint64_t in_cubes = 0, bricks = 0;
    bool is_same = true;
    is_complete_ = true;
    map_access<Map>::for_each_octant(map, [&](const octree::voxel_key& low, int level, const octree::octant_states& s) {
      const std::uint64_t mask = obstacles(s);
      const voxel_cube node{low, level};
      const bool is_in_cube = voxels_.is_in_cube(node);
      if (is_in_cube) in_cubes += volume(level);
      if (mask == (is_in_cube ? ~elsewhere : elsewhere)) return;  // equal to the value of space that is not stored
      if (level >= cube_level && mask == (is_in_cube ? elsewhere : ~elsewhere)) {
        const std::uint64_t more = voxels_.max_added_bricks(node);
        if (!is_in_cube && cubes_.bricks + more > options_.max_bricks) {
          is_complete_ = false;
        } else if (is_first) {
          cubes.push_back(node);
          cubes_.bricks += more;
          cubes_.volume += volume(level);
        } else {
          is_same = false;
        }
        return;
      }
      if (level > 3 && (bricks += volume(level - 3)) > options_.max_bricks) {
        is_complete_ = false;
        return;
      }
      const std::uint32_t cells = octree::node_cells(level);
      for (std::uint32_t z = 0; z != cells; z += 4)
        for (std::uint32_t y = 0; y != cells; y += 4)
          for (std::uint32_t x = 0; x != cells; x += 4) {
            const octree::voxel_key k{low.x + x, low.y + y, low.z + z};
            if (!voxels_.is_stored(k)) octants_.push_back({k, mask});
          }
    });
    if (!cubes.empty()) voxels_.begin(cubes);
    // The traversal does not visit parts of a cube that have become unknown in the map.
    return is_same && (is_first || in_cubes == cubes_.volume);
  }
  /// Volume of a node in voxels.
  [[nodiscard]] static std::uint64_t volume(int level) noexcept { return std::uint64_t{1} << (3 * level); }
  template <class = void>
  void apply() {
    voxels_.update(octants_);
    // Keep the capacity that typical updates need, so that they allocate nothing.
    constexpr std::size_t few = (std::size_t{1} << 20U) / sizeof(octant_obstacles);
    if (octants_.capacity() > std::max(few, 8 * voxels_.brick_count())) octants_ = std::vector<octant_obstacles>();
  }
  [[nodiscard]] std::uint64_t obstacles(const octree::octant_states& s) const noexcept {
    const std::uint64_t found = options_.unknown == octree::occupancy::occupied ? ~s.free() : s.occupied;
    return options_.inside ? ~found : found;
  }

  distance_field_options options_;
  detail::map_follower follower_;
  std::vector<octant_obstacles> octants_;
  struct {
    std::uint64_t bricks = 0, volume = 0;
  } cubes_;  ///< totals of the cubes that the field was initialised with
  bool is_complete_ = true;
};

}  // namespace orbis::nav

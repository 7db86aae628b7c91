// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Planning space for a robot in an occupancy map with a distance field, exact in continuous space.
#pragma once

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

#include <orbis/core/types.hpp>
#include <orbis/nav/detail/path/segments.hpp>
#include <orbis/nav/distance_field.hpp>
#include <orbis/nav/map_access.hpp>
#include <orbis/nav/planning_space.hpp>
#include <orbis/nav/robot_shape.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/octants.hpp>
#include <orbis/octree/overlap.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::nav {
namespace detail {

/// State of a voxel. @pre `k` is in the grid
template <planning_map Map>
[[nodiscard]] octree::occupancy state_of(const Map& map, const octree::voxel_key& k) {
  if constexpr (requires { map_access<Map>::state(map, k); }) {
    return map_access<Map>::state(map, k);
  } else {
    const octree::octant_states states = map_access<Map>::octants(map)(k);
    const std::uint64_t voxel = std::uint64_t{1} << (octree::morton_code(k) & 63U);
    if ((states.known & voxel) == 0) return octree::occupancy::unknown;
    return (states.occupied & voxel) != 0 ? octree::occupancy::occupied : octree::occupancy::free;
  }
}

/// Recursive search for `octants_overlap`.
template <class Octants, octree::overlap_shape Shape>
class octant_overlap_search {
 public:
  octant_overlap_search(const octree::voxel_grid& grid, Octants octants, const Shape& shape, bool unknown_blocks)
      : grid_{grid}, octants_{std::move(octants)}, shape_{shape}, unknown_blocks_{unknown_blocks} {}

  [[nodiscard]] bool run() {
    const octree::bounding_box bounds = bounds_of(shape_);
    const double edge = grid_.resolution() * (grid_.cells() / 2);
    const bool is_inside = all_at_most(filled<vec3>(-edge), bounds.min) && all_at_most(bounds.max, filled<vec3>(edge));
    if (unknown_blocks_ && !is_inside) return true;
    // Includes voxels whose faces only touch the shape.
    const auto keys =
        octree::keys_between(grid_, shifted(bounds.min, -grid_.resolution()), shifted(bounds.max, grid_.resolution()));
    if (!keys) return false;
    const std::uint32_t differ =
        (keys->low.x ^ keys->high.x) | (keys->low.y ^ keys->high.y) | (keys->low.z ^ keys->high.z);
    const int level = std::max(octant_level, static_cast<int>(std::bit_width(differ)));
    return is_met(*keys, octree::node_key(keys->low, level), level);
  }

 private:
  static constexpr int octant_level = 2;

  [[nodiscard]] bool touches_cube(const octree::voxel_key& k, int level) const {
    return touches(shape_, octree::node_cube(grid_, k, level));
  }
  [[nodiscard]] bool is_met(const octree::key_box& keys, const octree::voxel_key& k, int level) {
    if (!keys.overlaps(k, level) || !touches_cube(k, level)) return false;
    if (level == octant_level) return is_met_in(k);
    for (unsigned i = 0; i != 8; ++i)
      if (is_met(keys, octree::child_key(k, i, octree::node_cells(level - 1)), level - 1)) return true;
    return false;
  }
  [[nodiscard]] bool is_met_in(const octree::voxel_key& octant) {
    const octree::octant_states states = octants_(octant);
    std::uint64_t blocking = unknown_blocks_ ? ~states.free() : states.occupied;
    if (blocking == ~std::uint64_t{0}) return true;
    for (; blocking != 0; blocking &= blocking - 1) {
      const octree::voxel_key in = octree::morton_key(static_cast<std::uint64_t>(std::countr_zero(blocking)));
      if (touches_cube({octant.x + in.x, octant.y + in.y, octant.z + in.z}, 0)) return true;
    }
    return false;
  }

  octree::voxel_grid grid_;
  Octants octants_;
  const Shape& shape_;
  bool unknown_blocks_;
};

/// octree::overlaps, implemented with the octants of a map. O(octants that the shape touches).
template <planning_map Map, octree::overlap_shape Shape>
[[nodiscard]] bool octants_overlap(const Map& map, const Shape& shape, const octree::overlap_options& options) {
  const bool unknown_blocks = options.unknown == octree::occupancy::occupied;
  return octant_overlap_search{map_access<Map>::grid(map), map_access<Map>::octants(map), shape, unknown_blocks}.run();
}
/// octree::overlaps for any map. @pre finite coordinates
template <planning_map Map, octree::overlap_shape Shape>
[[nodiscard]] bool map_overlaps(const Map& map, const Shape& shape, const octree::overlap_options& options) {
  if constexpr (requires { map_access<Map>::overlaps(map, shape, options); })
    return map_access<Map>::overlaps(map, shape, options);
  else
    return octants_overlap(map, shape, options);
}

}  // namespace detail

/// Tests whether a robot is free, at rest or moving along a segment. The result equals that of `octree::overlaps` for
/// the robot's shape or the volume that it sweeps (for a ball, a capsule), with unknown space treated as in the field.
/// Nothing is sampled or approximated by voxel centres; the two results differ only by rounding, where the robot just
/// touches a voxel. The field alone is sufficient if obstacles are far away, or so near that the robot certainly
/// touches one; the map is read only in the narrow band between these cases.
///
/// A `planning_space`. The view refers to the map and the field; neither may change while the view is used. Safe for
/// concurrent queries.
template <planning_map Map, robot_shape Shape = ball>
class planning_view {
 public:
  static constexpr int dimensions = 3;

  /// The field's reach should exceed the robot's radius by at least two voxels, and the field should be complete
  /// (`is_complete`). Otherwise, queries only take longer: an incomplete field is used only for distances in costs.
  /// @pre the shape and the options satisfy their own preconditions; the field belongs to the map, is up to date, and
  /// contains distances to obstacles (not `inside`)
  planning_view(const Map& map, const distance_field& field, const Shape& shape, const planning_options& options = {})
      : map_{&map}, field_{&field}, shape_{shape}, cover_{covering_balls(shape)}, options_{options} {
    assert(cover_.inner > 0.0 && map_access<Map>::grid(map) == field.grid() && !field.options().inside);
    assert(options.clearance_weight >= 0.0 && options.preferred_clearance > 0.0 && options.unknown_cost >= 1.0);
  }
  /// Creates a view for a robot that is a ball. `radius`: metres. @pre radius > 0
  planning_view(const Map& map, const distance_field& field, double radius,
                const planning_options& options = {}) requires std::same_as<Shape, ball>
      : planning_view{map, field, ball{radius}, options} {}
  // Temporaries would not outlive the view.
  planning_view(const Map&&, const distance_field&, const Shape&, const planning_options& = {}) = delete;
  planning_view(const Map&, const distance_field&&, const Shape&, const planning_options& = {}) = delete;
  planning_view(const Map&&, const distance_field&, double,
                const planning_options& = {}) requires std::same_as<Shape, ball>
  = delete;
  planning_view(const Map&, const distance_field&&, double,
                const planning_options& = {}) requires std::same_as<Shape, ball>
  = delete;

  /// Returns true if the robot touches no obstacle with its reference point at `p` (metres). False if `p` is not
  /// finite, or outside the region. O(1) away from obstacles; near them, as expensive as `overlaps`.
  [[nodiscard]] bool is_free(const vec3& p) const { return is_free(p, p); }
  /// Returns true if the robot touches no obstacle on the straight segment from `a` to `b` (metres). False if an end is
  /// outside the region, or the segment is longer than four times the edge of the map's grid. O(length / distance to
  /// the obstacles), plus the cost of `overlaps` for every 4 voxels of the segment near obstacles.
  [[nodiscard]] bool is_free(const vec3& a, const vec3& b) const {
    const double cell = resolution();
    if (!is_in_region(a) || !is_in_region(b) || !is_short(a, b)) return false;
    squared_distance_view::reader reader{field_->voxels()};
    return detail::is_segment_free(
        a, b, cell, [&](const vec3& p) { return margin(reader, p); },
        [&](const vec3& p, const vec3& q) { return overlaps(p, q); });
  }
  /// Returns true if no obstacle is within `by` (metres) of the volume that the robot sweeps from `a` to `b`: is_free
  /// for an inflated robot, exact for a ball and a vertical capsule. A vertical cylinder is inflated in radius and
  /// height; a user-defined shape is replaced by a vertical capsule around the balls that cover it. @pre by >= 0
  [[nodiscard]] bool is_free(const vec3& a, const vec3& b, double by) const {
    const planning_view<Map, decltype(detail::grown(shape_, by))> thicker{*map_, *field_, detail::grown(shape_, by),
                                                                          options_};
    return thicker.is_free(a, b);
  }
  /// Returns true if the field alone proves a segment free. False does not mean that the segment is blocked: a test
  /// with the map may find it free. O(length / distance to the obstacles).
  [[nodiscard]] bool is_surely_free(const vec3& a, const vec3& b) const {
    if (!is_in_region(a) || !is_in_region(b) || !is_short(a, b)) return false;
    squared_distance_view::reader reader{field_->voxels()};
    return detail::is_segment_certainly_free(a, b, resolution(), [&](const vec3& p) { return margin(reader, p); });
  }
  /// Returns true if the robot is free with its reference point at the centre of voxel `k`. @pre contains(k)
  [[nodiscard]] bool is_free(const octree::voxel_key& k) const {
    squared_distance_view::reader reader{field_->voxels()};
    const vec3 p = center(k);
    const double m = margin(reader, p);
    return m != detail::blocked && (m >= 0.0 || !overlaps(p, p));
  }

  /// Cost per metre in the voxel, see planning_options. @pre contains(k)
  [[nodiscard]] double density(const octree::voxel_key& k) const {
    double sum = 1.0;
    if (options_.clearance_weight > 0.0) {
      double least = field_->reach();
      const vec3 p = center(k);
      for (int i = 0; i != cover_.count; ++i) least = std::min(least, field_->distance(ball_at(p, i)));
      sum = detail::clearance_density(options_, least - cover_.outer);
    }
    if (options_.unknown_cost > 1.0 && detail::state_of(*map_, k) == octree::occupancy::unknown)
      sum *= options_.unknown_cost;
    return sum;
  }
  /// Returns true if the cost of every path equals its length.
  [[nodiscard]] bool is_uniform() const noexcept {
    return options_.clearance_weight == 0.0 && options_.unknown_cost == 1.0;
  }

  /// The voxel of `p` (metres); empty if `p` is outside the grid or the region, or not finite. O(1).
  [[nodiscard]] std::optional<octree::voxel_key> key(const vec3& p) const {
    return is_in_region(p) ? grid().key(p) : std::nullopt;
  }
  /// Returns true if the voxel is in the grid, and its centre is in the region.
  [[nodiscard]] bool contains(const octree::voxel_key& k) const noexcept {
    return std::max({k.x, k.y, k.z}) < grid().cells() && (!options_.region || is_in_region(center(k)));
  }
  /// The centre of a voxel, metres.
  [[nodiscard]] vec3 center(const octree::voxel_key& k) const noexcept { return grid().center(k); }
  /// The point of the grid that is nearest to `p`, metres.
  [[nodiscard]] vec3 clamped(const vec3& p) const {
    const double edge = 0.5 * resolution() * grid().cells();
    return entrywise_min(entrywise_max(p, filled<vec3>(-edge)), filled<vec3>(edge));
  }
  /// `p` unchanged.
  [[nodiscard]] const vec3& placed(const vec3& p) const noexcept { return p; }
  /// `p` unchanged: there is no floor.
  [[nodiscard]] const vec3& on_ground(const vec3& p) const noexcept { return p; }

  [[nodiscard]] const Map& map() const noexcept { return *map_; }
  [[nodiscard]] const distance_field& field() const noexcept { return *field_; }
  [[nodiscard]] const octree::voxel_grid& grid() const noexcept { return field_->grid(); }
  /// Edge length of a voxel, metres.
  [[nodiscard]] double resolution() const noexcept { return grid().resolution(); }
  [[nodiscard]] const Shape& shape() const noexcept { return shape_; }
  [[nodiscard]] const planning_options& options() const noexcept { return options_; }
  /// Radius of the robot, metres.
  [[nodiscard]] double radius() const noexcept { return shape_.radius; }

 private:
  [[nodiscard]] bool is_short(const vec3& a, const vec3& b) const noexcept {
    return norm(b - a) <= 4.0 * resolution() * grid().cells();
  }
  [[nodiscard]] bool is_in_region(const vec3& p) const noexcept {
    if (!all_finite(p)) return false;
    const auto& r = options_.region;
    return !r || (all_at_most(r->min, p) && all_at_most(p, r->max));
  }
  [[nodiscard]] vec3 ball_at(const vec3& p, int i) const noexcept {
    return {p.x(), p.y(), p.z() + cover_.low + i * cover_.spacing};
  }
  /// See detail::is_segment_free.
  [[nodiscard]] double margin(squared_distance_view::reader& reader, const vec3& p) const {
    if (!field_->is_complete()) return -cover_.outer;
    double least = field_->reach();
    for (int i = 0; i != cover_.count; ++i) {
      const double m = ball_margin(reader, ball_at(p, i));
      if (m == detail::blocked) return m;
      least = std::min(least, m);
    }
    return least;
  }
  /// The margin of one of the balls that cover the robot. The ball's centre is about as far from obstacles as the
  /// centres of the surrounding voxels, and an obstacle's cube is half a voxel to half a diagonal nearer than its
  /// centre.
  [[nodiscard]] double ball_margin(squared_distance_view::reader& reader, const vec3& q) const {
    const double cell = resolution();
    const auto k = grid().key(q);
    if (!k) return -cover_.outer;
    double least = 0.0,
           most = std::numeric_limits<double>::infinity();  // distances to the centre of the nearest obstacle
    const auto look = [&](const octree::voxel_key& at, const vec3& away) {
      const std::uint16_t squared = reader.squared(at);
      const bool is_far = squared == squared_distance_view::far;
      const double d = is_far ? field_->reach() : std::sqrt(static_cast<double>(squared)) * cell, off = norm(away);
      least = std::max(least, d - off);
      if (!is_far) most = std::min(most, d + off);
    };
    const vec3 away = q - center(*k);
    look(*k, away);
    const auto is_certain = [&] {
      return most - 0.4999 * cell < cover_.inner || least - 0.8661 * cell - cover_.outer > 0.5 * cell;
    };
    // Outside the grid, the field has no distances to obstacles in the grid.
    if (!is_certain() && away != zeros<vec3>())
      for (unsigned i = 1; i != 8; ++i) {
        const auto beside = [&](unsigned bit, int axis) { return (i & bit) == 0 ? 0 : away[axis] < 0.0 ? -1 : 1; };
        const int x = beside(1U, 0), y = beside(2U, 1), z = beside(4U, 2);
        const octree::voxel_key at{k->x + static_cast<std::uint32_t>(x), k->y + static_cast<std::uint32_t>(y),
                                   k->z + static_cast<std::uint32_t>(z)};
        if (std::max({at.x, at.y, at.z}) < grid().cells())
          look(at, away - cell * vec3{static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)});
      }
    return most - 0.4999 * cell < cover_.inner ? detail::blocked : least - 0.8661 * cell - cover_.outer;
  }
  [[nodiscard]] bool overlaps(const vec3& a, const vec3& b) const {
    return detail::map_overlaps(*map_, swept(shape_, a, b), {.unknown = field_->options().unknown});
  }

  const Map* map_;
  const distance_field* field_;
  Shape shape_;
  ball_cover cover_;
  planning_options options_;
};

}  // namespace orbis::nav

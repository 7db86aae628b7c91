// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Planning space for a round robot on a floor, for paths in two dimensions.
///
/// @code
///   const auto floor = orbis::nav::make_floor_map(map, robot);
///   const orbis::nav::floor_view view{*floor, robot.radius};
///   const auto path = orbis::nav::find_path(view, start, goal);  // points at the floor's height
/// @endcode
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <optional>

#include <orbis/core/image.hpp>
#include <orbis/core/types.hpp>
#include <orbis/nav/detail/path/segments.hpp>
#include <orbis/nav/floor_cost.hpp>
#include <orbis/nav/floor_map.hpp>
#include <orbis/nav/planning_space.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/overlap.hpp>

namespace orbis::nav {

/// Tests whether a disc, at rest or moving along a segment, is free on a floor, i.e. has no point in common with the
/// square of an occupied cell. The results are exact. Space outside the map counts as unknown cells.
///
/// A `planning_space` that ignores z: distances are horizontal, and the points of a path are reported at the floor
/// height of their cells. The view refers to the floor map, which must not change while the view is used. Safe for
/// concurrent queries.
class floor_view {
 public:
  static constexpr int dimensions = 2;

  /// `radius`: radius of the robot, metres. `unknown`: state assumed for unknown cells. O(cells).
  /// @pre radius > 0; fewer than 2^21 cells along x and y; `options` satisfies its own preconditions
  floor_view(const floor_map& map, double radius, const planning_options& options = {},
             octree::occupancy unknown = octree::occupancy::occupied)
      : map_{&map}, radius_{radius}, options_{options} {
    look_at_obstacles(unknown, [&](int x, int y) { return map.states(x, y); });
  }
  /// Creates a view for the centre of a robot on a cost map (see inflate), which accounts for the robot's radius: cells
  /// with a cost of at least `inscribed` are obstacles; in other cells, the cost per metre is 1 + clearance_weight *
  /// cost / 252; preferred_clearance is ignored.
  /// @pre same as for the constructor with a radius; `costs` belongs to `map` and outlives the view
  floor_view(const floor_map& map, const image<std::uint8_t>& costs, const planning_options& options = {},
             octree::occupancy unknown = octree::occupancy::occupied)
      : map_{&map}, costs_{&costs}, options_{options} {
    assert(costs.width() == map.states.width() && costs.height() == map.states.height());
    look_at_obstacles(unknown, [&](int x, int y) {
      const std::uint8_t cost = costs(x, y);
      return cost == floor_cost::no_information ? floor_state::unknown
             : cost >= floor_cost::inscribed    ? floor_state::occupied
                                                : floor_state::free;
    });
  }
  // A temporary would not outlive the view.
  floor_view(const floor_map&&, double, const planning_options& = {},
             octree::occupancy = octree::occupancy::occupied) = delete;
  floor_view(const floor_map&&, const image<std::uint8_t>&, const planning_options& = {},
             octree::occupancy = octree::occupancy::occupied) = delete;
  floor_view(const floor_map&, const image<std::uint8_t>&&, const planning_options& = {},
             octree::occupancy = octree::occupancy::occupied) = delete;

  /// Returns true if the disc around `p` (metres) touches no obstacle. False outside the map or the region. O(1)
  /// away from obstacles, O((radius / resolution)^2) near them.
  [[nodiscard]] bool is_free(const vec3& p) const { return is_free(p, p); }
  /// Returns true if the disc touches no obstacle on the straight segment from `a` to `b` (metres). O(length / distance
  /// to the obstacles), plus, near obstacles, the cells in the box around each group of 4 cells on the segment.
  [[nodiscard]] bool is_free(const vec3& a, const vec3& b) const { return is_free(a, b, 0.0); }
  /// Like `is_free(a, b)`, for a disc whose radius is larger by `by` (metres). @pre by >= 0
  [[nodiscard]] bool is_free(const vec3& a, const vec3& b, double by) const {
    if (!key(a) || !key(b)) return false;
    const double radius = radius_ + by;
    return detail::is_segment_free(
        placed(a), placed(b), resolution(), [&](const vec3& p) { return margin(p, radius); },
        [&](const vec3& p, const vec3& q) { return overlaps(p, q, radius); });
  }
  /// Equal to `is_free(a, b)`.
  [[nodiscard]] bool is_surely_free(const vec3& a, const vec3& b) const { return is_free(a, b); }
  /// Returns true if the disc at the centre of a cell is free. @pre contains(k)
  [[nodiscard]] bool is_free(const octree::voxel_key& k) const {
    const double m = margin(center(k), radius_);
    return m != detail::blocked && (m >= 0.0 || !overlaps(center(k), center(k), radius_));
  }

  /// Cost per metre in the cell, see planning_options. @pre contains(k)
  [[nodiscard]] double density(const octree::voxel_key& k) const {
    const int x = static_cast<int>(k.x), y = static_cast<int>(k.y);
    const double near = costs_ == nullptr ? detail::clearance_density(options_, distance(x, y) - radius_)
                                          : 1.0 + options_.clearance_weight *
                                                      std::min<int>((*costs_)(x, y), floor_cost::inscribed - 1) /
                                                      (floor_cost::inscribed - 1);
    return is_unknown(x, y) ? near * options_.unknown_cost : near;
  }
  /// Returns true if the cost of every path equals its length.
  [[nodiscard]] bool is_uniform() const noexcept {
    return options_.clearance_weight == 0.0 && options_.unknown_cost == 1.0;
  }

  /// The cell of `p` (metres); empty if `p` is outside the map or the region, or not finite. O(1).
  [[nodiscard]] std::optional<octree::voxel_key> key(const vec3& p) const {
    const auto cell = is_in_region(p) ? map_->cell(p) : std::nullopt;
    if (!cell) return std::nullopt;
    return octree::voxel_key{static_cast<std::uint32_t>((*cell)[0]), static_cast<std::uint32_t>((*cell)[1]), 0};
  }
  /// Returns true if the cell is in the map, and its centre in the region.
  [[nodiscard]] bool contains(const octree::voxel_key& k) const noexcept {
    return k.x < static_cast<std::uint32_t>(map_->states.width()) &&
           k.y < static_cast<std::uint32_t>(map_->states.height()) && k.z == 0 && is_in_region(center(k));
  }
  /// The centre of a cell, metres; z = 0.
  [[nodiscard]] vec3 center(const octree::voxel_key& k) const noexcept {
    const vec2 p = map_->center(static_cast<int>(k.x), static_cast<int>(k.y));
    return {p.x(), p.y(), 0.0};
  }
  /// The point of the map that is nearest to `p`, metres; z = 0.
  [[nodiscard]] vec3 clamped(const vec3& p) const {
    const double width = map_->states.width(), height = map_->states.height();
    return {std::clamp(p.x(), map_->origin.x(), map_->origin.x() + width * resolution()),
            std::clamp(p.y(), map_->origin.y(), map_->origin.y() + height * resolution()), 0.0};
  }
  /// `p` with z = 0.
  [[nodiscard]] vec3 placed(const vec3& p) const noexcept { return {p.x(), p.y(), 0.0}; }
  /// `p` at the height of the floor in its cell or, where the robot cannot go, at the overall floor height.
  [[nodiscard]] vec3 on_ground(const vec3& p) const {
    const auto cell = map_->cell(p);
    const double height = cell && !map_->heights.empty() ? map_->heights((*cell)[0], (*cell)[1]) : map_->floor;
    return {p.x(), p.y(), std::isfinite(height) ? height : map_->floor};
  }

  [[nodiscard]] const floor_map& map() const noexcept { return *map_; }
  /// Squared distance from each cell to the nearest obstacle, in cells, with a border of one cell around the map. See
  /// squared_floor_distances.
  [[nodiscard]] const image<float>& squared_distances() const noexcept { return squared_; }
  /// Edge length of a cell, metres.
  [[nodiscard]] double resolution() const noexcept { return map_->resolution; }
  /// Radius of the robot, metres; 0 on a cost map.
  [[nodiscard]] double radius() const noexcept { return radius_; }

 private:
  template <class StateOf>
  void look_at_obstacles(octree::occupancy unknown, StateOf&& state_of) {
    const int width = map_->states.width(), height = map_->states.height();
    assert(radius_ >= 0.0 && std::max(width, height) < 1 << 21 && options_.unknown_cost >= 1.0);
    assert(options_.clearance_weight >= 0.0 && options_.preferred_clearance > 0.0);
    const bool unknown_blocks = unknown == octree::occupancy::occupied;
    const auto blocks = [&](floor_state s) {
      return s == floor_state::occupied || (s == floor_state::unknown && unknown_blocks);
    };
    // A border of unknown cells represents the space outside the map.
    image<floor_state> states(width + 2, height + 2, unknown_blocks ? floor_state::occupied : floor_state::free);
    for (int y = 0; y != height; ++y)
      for (int x = 0; x != width; ++x)
        states(x + 1, y + 1) = blocks(state_of(x, y)) ? floor_state::occupied : floor_state::free;
    squared_ = squared_floor_distances(states);
  }
  [[nodiscard]] bool is_unknown(int x, int y) const {
    return costs_ == nullptr ? map_->states(x, y) == floor_state::unknown
                             : (*costs_)(x, y) == floor_cost::no_information;
  }
  [[nodiscard]] bool is_in_region(const vec3& p) const noexcept {
    if (!all_finite(p)) return false;
    const auto& r = options_.region;
    return !r || (p.x() >= r->min.x() && p.y() >= r->min.y() && p.x() <= r->max.x() && p.y() <= r->max.y());
  }
  /// Distance between the centres of the cell and the nearest obstacle, metres.
  [[nodiscard]] double distance(int x, int y) const {
    return std::sqrt(static_cast<double>(squared_(x + 1, y + 1))) * resolution();
  }
  /// The margin at `p`, see detail::is_segment_free. The nearest point of an obstacle's cell is closer to `p` than the
  /// centre of the cell, by half a cell to half a diagonal.
  [[nodiscard]] double margin(const vec3& p, double radius) const {
    const auto cell = map_->cell(p);
    if (!cell) return -radius - resolution();
    const double d = distance((*cell)[0], (*cell)[1]);
    const double off = norm(map_->center((*cell)[0], (*cell)[1]) - head<2>(p));
    if (d + off - 0.4999 * resolution() < radius) return detail::blocked;
    return d - off - 0.7072 * resolution() - radius;
  }
  /// Returns true if the swept disc touches an obstacle. @pre z = 0
  [[nodiscard]] bool overlaps(const vec3& a, const vec3& b, double radius) const {
    const octree::capsule way{a, b, radius};
    const octree::bounding_box box = bounds_of(way);
    const auto index = [&](double p, double origin, int cells) {  // index into squared_, which has a border
      return std::clamp(static_cast<int>(std::floor((p - origin) / resolution())) + 1, 0, cells - 1);
    };
    const double edge = resolution();  // includes cells whose faces only touch the disc
    const int left = index(box.min.x() - 0.5 * edge, map_->origin.x(), squared_.width());
    const int right = index(box.max.x() + 0.5 * edge, map_->origin.x(), squared_.width());
    const int low = index(box.min.y() - 0.5 * edge, map_->origin.y(), squared_.height());
    const int high = index(box.max.y() + 0.5 * edge, map_->origin.y(), squared_.height());
    for (int y = low; y <= high; ++y)
      for (int x = left; x <= right; ++x) {
        if (squared_(x, y) != 0.0F) continue;
        const vec2 corner = map_->origin + edge * vec2{x - 1.0, y - 1.0};
        const octree::bounding_box square{{corner.x(), corner.y(), 0.0}, {corner.x() + edge, corner.y() + edge, 0.0}};
        if (touches(way, square)) return true;
      }
    return false;
  }

  const floor_map* map_;
  const image<std::uint8_t>* costs_ = nullptr;
  double radius_ = 0.0;
  planning_options options_;
  image<float> squared_{};  ///< see squared_floor_distances, with a border of one cell
};

}  // namespace orbis::nav

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Where a round robot fits: an occupancy map and its distance field as one, exact in continuous space.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>

#include <orbis/core/types.hpp>
#include <orbis/nav/distance_field.hpp>
#include <orbis/octree/accessor.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/overlap.hpp>

namespace orbis::nav {

/// Whether a ball is free, at rest or on its way along a segment. The answer is that of `octree::overlaps` for the ball
/// or the capsule, with what unknown space counts as in the field: it is not sampled, and not taken from the middles of
/// voxels. The field says it where obstacles are far away, and only in the narrow band near them the map is asked.
///
/// It refers to the map and the field; both must stay as they are while it is used. Any number of threads may ask.
template <octree::octree_map Map>
class planning_view {
 public:
  /// `radius`: of the robot, metres. The field should reach at least two voxels farther; less costs time only.
  /// @pre radius > 0; the field is that of the map, up to date
  planning_view(const Map& map, const distance_field& field, double radius)
      : map_{&map}, field_{&field}, radius_{radius} {
    assert(radius > 0.0 && map.grid() == field.grid());
  }

  /// Whether the ball with its centre at `p` (metres) touches no obstacle. False if `p` is not finite. O(1) away from
  /// obstacles, and what `overlaps` costs near them.
  [[nodiscard]] bool is_free(const vec3& p) const { return is_free(p, p); }
  /// Whether the ball touches no obstacle on its straight way from `a` to `b` (metres). False if the way is longer than
  /// four edges of the map's grid. O(length / distance to the obstacles), and what `overlaps` costs for each 4 voxels
  /// near them.
  [[nodiscard]] bool is_free(const vec3& a, const vec3& b) const {
    if (!a.allFinite() || !b.allFinite()) return false;
    const double length = (b - a).norm(), cell = field_->grid().resolution();
    if (!(length <= 4.0 * cell * field_->grid().cells())) return false;
    const auto at = [&](double t) -> vec3 { return t >= length ? b : vec3{a + (b - a) * (t / length)}; };
    double t = 0.0;
    do {
      // What lies within the clearance of a point on the way is free; so are balls whose centres are that much nearer.
      const vec3 p = at(t);
      double step = field_->clearance(p) - radius_ - 1e-9 * cell;
      if (step < 0.5 * cell) {
        step = 4.0 * cell;
        if (overlaps(octree::capsule{p, at(t + step), radius_})) return false;
      }
      t += step;
    } while (t < length);
    return true;
  }
  /// Whether the ball with its centre in the middle of voxel `k` is free. @pre k lies in the grid
  [[nodiscard]] bool is_free(const octree::voxel_key& k) const {
    const double cell = field_->grid().resolution();
    const std::uint16_t squared = field_->voxels().squared(k);
    const bool is_far = squared == squared_distance_view::far;
    // The obstacle's cube is half a voxel to half a diagonal nearer than its middle.
    const double d = is_far ? field_->reach() : std::sqrt(static_cast<double>(squared)) * cell;
    if (d - 0.8661 * cell > radius_) return true;
    if (!is_far && d - 0.4999 * cell < radius_) return false;
    const vec3 p = field_->grid().center(k);
    return !overlaps(octree::capsule{p, p, radius_});
  }

  [[nodiscard]] const Map& map() const noexcept { return *map_; }
  [[nodiscard]] const distance_field& field() const noexcept { return *field_; }
  /// Of the robot, metres.
  [[nodiscard]] double radius() const noexcept { return radius_; }

 private:
  [[nodiscard]] bool overlaps(const octree::capsule& c) const {
    return octree::overlaps(*map_, c, {.unknown = field_->options().unknown});
  }

  const Map* map_;
  const distance_field* field_;
  double radius_;
};

}  // namespace orbis::nav
